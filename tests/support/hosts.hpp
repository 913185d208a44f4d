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

/// Computers of one test, connected by a switch. They are network namespaces, each with its own
/// address, loopback interface and firewall rules. The kernel keeps them only while this object or
/// a process inside exists. So nothing is left behind, however a test ends, and concurrent tests do
/// not see each other.
class Hosts {
 public:
  /// Why there can be no hosts here; empty if there can.
  [[nodiscard]] static std::string missing();

  /// @throws std::runtime_error with what the tools said.
  explicit Hosts(std::size_t count);
  ~Hosts();
  Hosts(const Hosts&) = delete;
  Hosts& operator=(const Hosts&) = delete;

  [[nodiscard]] std::size_t count() const { return hosts_.size(); }
  [[nodiscard]] static std::string address(std::size_t host);

  [[nodiscard]] Process start(std::size_t host, const std::vector<std::string>& argv) const;

  /// Moves the calling thread to a host, with all threads and sockets that it creates from now on.
  /// The thread that created this object returns when the object is destroyed.
  void enter(std::size_t host) const;

  /// Runs a function on a host, in its own thread. @return its result
  template <class Function>
  [[nodiscard]] auto on(std::size_t host, Function function) const {
    std::optional<decltype(function())> result;
    std::thread([&] {
      enter(host);
      result.emplace(function());
    }).join();
    return *std::move(result);
  }

  /// From now on each host drops this share of the packets that arrive over the network, at random.
  void lose(int percent) const;
  /// How many packets all hosts have dropped so far.
  [[nodiscard]] std::uint64_t lost() const;

  /// Unplugs a host's cable from the switch, and plugs it in again.
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

  int home_ = -1;  // the namespace in which the test started
  Network switch_;
  std::vector<Network> hosts_;
};

/// Starts Fast DDS's discovery server on a host, with id 0, and waits until it runs.
/// @param backup  a directory in which it stores its data for its successor; empty: it does not
[[nodiscard]] Process start_discovery_server(const Hosts& hosts, std::size_t host,
                                             const std::string& backup = {});
/// Whether a killed server's successor can read its stored data: that of Fast DDS 3.1 crashes when
/// it reads them.
[[nodiscard]] constexpr bool discovery_server_reads_backup() { return TFDUDE_FASTDDS_MAJOR == 2; }
/// The server's address, for --discovery-server.
[[nodiscard]] std::string discovery_address(std::size_t host);

/// Whether a test must be skipped because Hosts does not work here. Then prints that, in the words
/// by which ctest recognizes a skipped test.
[[nodiscard]] bool skip_without_hosts();

}  // namespace tfdude::testing
