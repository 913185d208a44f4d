#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/process.hpp"

namespace tfdude::testing {

/// Computers of one test, joined by a switch: network namespaces, each with an address, a loopback
/// interface and firewall rules of its own. The kernel keeps them only as long as this object or a
/// process inside is there, so nothing is left behind, however a test ends, and tests at the same
/// time do not meet.
class Hosts {
 public:
  /// Why there can be no hosts here; empty where there can.
  [[nodiscard]] static std::string missing();

  /// @throws std::runtime_error with what the tools said.
  explicit Hosts(std::size_t count);
  ~Hosts();
  Hosts(const Hosts&) = delete;
  Hosts& operator=(const Hosts&) = delete;

  [[nodiscard]] std::size_t count() const { return hosts_.size(); }
  [[nodiscard]] static std::string address(std::size_t host);

  [[nodiscard]] Process start(std::size_t host, const std::vector<std::string>& argv) const;

  /// Moves the calling thread to a host, with all threads and sockets that it makes from now on.
  /// The thread that has made this object returns as that goes.
  void enter(std::size_t host) const;

  /// What a function gives that runs on a host, in a thread of its own.
  template <class Function>
  [[nodiscard]] auto on(std::size_t host, Function function) const {
    std::optional<decltype(function())> result;
    std::thread([&] {
      enter(host);
      result.emplace(function());
    }).join();
    return *std::move(result);
  }

  /// From now on each host drops this share of all packets that come to it over the network, at
  /// random.
  void lose(int percent) const;
  /// How many were dropped so far, by all hosts.
  [[nodiscard]] std::uint64_t lost() const;

  /// Pulls a host's cable out of the switch, and puts it back.
  void cut(std::size_t host) const;
  void heal(std::size_t host) const;

 private:
  /// An open namespace, closed with the object.
  class Network {
   public:
    Network();
    ~Network();
    Network(Network&& other) noexcept;
    Network& operator=(Network&&) = delete;
    [[nodiscard]] int fd() const { return fd_; }

   private:
    int fd_ = -1;
  };

  static std::string run(const Network& where, const std::string& script);

  int home_ = -1;  // where the test came from
  Network switch_;
  std::vector<Network> hosts_;
};

/// Starts Fast DDS's discovery server on a host, with id 0, and waits until it runs.
/// @param backup  a directory in which it keeps what it knows for its successor; empty: it does not
[[nodiscard]] Process start_discovery_server(const Hosts& hosts, std::size_t host,
                                             const std::string& backup = {});
/// Whether a server can be killed, and its successor read what it has kept: that of Fast DDS 3.1
/// crashes as it reads.
[[nodiscard]] constexpr bool discovery_server_reads_backup() { return TFDUDE_FASTDDS_MAJOR == 2; }
/// Where the others find it, for --discovery-server.
[[nodiscard]] std::string discovery_address(std::size_t host);

/// Whether a test has to be left out for want of what Hosts needs; then says so, in the words by
/// which ctest knows a test that was skipped.
[[nodiscard]] bool skip_without_hosts();

}  // namespace tfdude::testing
