#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"

#include "faults/schedule.hpp"
#include "support/domain_lease.hpp"
#include "support/hosts.hpp"
#include "support/process.hpp"
#include "support/test_domain.hpp"

namespace tfdude::faults {

/// Daemons that store their state, and places for clients. Each has its own host if there can be
/// hosts; otherwise all are on this computer, where no link can be cut. Belongs to one thread.
class Cluster {
 public:
  /// @param clients  number of hosts for clients, besides that of the observers
  Cluster(std::size_t partitions, std::size_t clients, std::vector<std::string> daemon_options);
  ~Cluster();
  Cluster(const Cluster&) = delete;
  Cluster& operator=(const Cluster&) = delete;

  [[nodiscard]] std::size_t partitions() const { return daemons_.size(); }
  /// Why no link can be cut; empty if links can be cut.
  [[nodiscard]] const std::string& no_links() const { return no_links_; }
  [[nodiscard]] const std::string& no_disk() const { return no_disk_; }
  [[nodiscard]] Means means() const { return {no_links_.empty(), clocks_, disk_}; }
  [[nodiscard]] std::string state_directory() const { return directory_.path() + "/state"; }

  [[nodiscard]] Client open_observer() const { return open_on(kObservers, Milliseconds(1000)); }
  [[nodiscard]] Client open_observer(Milliseconds timeout) const {
    return open_on(kObservers, timeout);
  }
  [[nodiscard]] Client open_client(std::size_t client) const {
    return open_on(client_host(client), Milliseconds(1000));
  }
  [[nodiscard]] testing::CliResult cli(const std::vector<std::string>& arguments) const;

  void start(std::size_t partition);
  void kill(std::size_t partition);
  /// From its next start on.
  void configure(std::size_t partition, Variant variant) { variants_[partition] = variant; }
  /// Sets a daemon's wall clock this far off [s], also after a restart; needs Debian's faketime.
  void step_clock(std::size_t partition, int seconds) const;
  /// Leaves no byte on the disk where the daemons keep their state; needs root.
  void fill_disk() const;
  void clear_disk() const;
  void pause(std::size_t partition);
  void resume(std::size_t partition);
  [[nodiscard]] bool runs(std::size_t partition) const { return daemons_[partition].has_value(); }
  [[nodiscard]] pid_t pid(std::size_t partition) const { return daemons_[partition]->pid(); }
  /// Whether a daemon has said that it serves. Does not wait.
  [[nodiscard]] bool ready(std::size_t partition);
  /// @throws std::runtime_error if it does not start to serve.
  void await_ready(std::size_t partition);
  /// Daemons that have ended without being killed, each as "p1 (status 1)". They are not started
  /// again.
  [[nodiscard]] std::vector<std::string> take_ended();
  /// The last lines of the log of a daemon and its predecessors.
  [[nodiscard]] std::string log_of(std::size_t partition) const;

  [[nodiscard]] std::size_t daemon_host(std::size_t partition) const { return 1 + partition; }
  [[nodiscard]] std::size_t client_host(std::size_t client) const {
    return 1 + partitions() + client;
  }
  // The host sees no difference of its network, but no packet passes.
  void cut(std::size_t host) const;
  void heal(std::size_t host) const;
  // The host sees that its cable is not connected.
  void unplug(std::size_t host) const { hosts_->cut(host); }
  void plug(std::size_t host) const { hosts_->heal(host); }
  // What two hosts send to each other.
  void part(std::size_t host, std::size_t other) const;
  void join(std::size_t host, std::size_t other) const;

 private:
  static constexpr std::size_t kObservers = 0;

  [[nodiscard]] Client open_on(std::size_t host, Milliseconds timeout) const;
  [[nodiscard]] std::vector<std::string> meeting() const;
  [[nodiscard]] std::string log_file(std::size_t partition) const;
  [[nodiscard]] std::string clock_file(std::size_t partition) const;
  [[nodiscard]] std::vector<std::string> configuration(std::size_t partition) const;
  void shell(std::size_t host, const std::string& script) const;

  testing::TemporaryDirectory directory_;
  const std::vector<std::string> daemon_options_;
  std::string no_links_;
  std::optional<testing::Hosts> hosts_;
  std::optional<testing::DomainLease> domain_;  // without hosts
  bool clocks_ = false;
  bool disk_ = false;
  std::string no_disk_;
  std::vector<Variant> variants_;
  std::vector<std::optional<testing::Process>> daemons_;
};

}  // namespace tfdude::faults
