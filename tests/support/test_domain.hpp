#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"

#include "support/domain_lease.hpp"
#include "support/hosts.hpp"
#include "support/process.hpp"

namespace tfdude::testing {

/// The result of a run of the command line.
struct CliResult {
  int status = -1;
  std::string out;
  std::string err;
};

/// A DDS domain that no other test uses now, on this computer only, and the service's programs in
/// it.
///
/// With TFDUDE_TEST_LOSS in the environment, a percentage, the same test runs over several hosts,
/// each of which loses this share of its incoming packets. The test's process is on one host, the
/// daemons are on others in turn, the command line is on another one. TFDUDE_TEST_DISCOVERY=server
/// selects discovery by a server instead of multicast.
class TestDomain {
 public:
  TestDomain();
  /// Checks that packets were lost if loss was requested.
  ~TestDomain();
  TestDomain(const TestDomain&) = delete;
  TestDomain& operator=(const TestDomain&) = delete;

  [[nodiscard]] std::uint32_t number() const { return lease_.number(); }

  /// For clients in the test's process. The time-out is long, so that a busy machine is not an
  /// error.
  [[nodiscard]] Options options(Milliseconds timeout = Milliseconds(20000)) const;

  /// Starts a daemon; await_ready() tells when it serves.
  /// @param wrapper  a program, with arguments, that is to start it
  [[nodiscard]] Process start_daemon(const std::vector<std::string>& arguments,
                                     const std::vector<std::string>& wrapper = {}) const;
  /// Starts a daemon for a configuration, and waits until it serves.
  [[nodiscard]] Process serve(const std::string& config) const;

  [[nodiscard]] Process start_cli(const std::vector<std::string>& arguments) const;
  /// @throws std::runtime_error if it does not end.
  [[nodiscard]] CliResult cli(const std::vector<std::string>& arguments) const;

 private:
  [[nodiscard]] std::vector<std::string> command(const char* program,
                                                 const std::vector<std::string>& arguments) const;
  [[nodiscard]] Process start(std::size_t host, const std::vector<std::string>& command) const;

  DomainLease lease_;
  std::optional<Hosts> hosts_;
  std::optional<Process> server_;  // for discovery
  std::string server_address_;
  mutable std::size_t daemons_ = 0;
};

/// @return the line by which a daemon says that it serves
/// @throws std::runtime_error with its output if it does not start to serve.
std::string await_ready(Process& daemon);

/// Waits for the end of a process. @throws std::runtime_error if it does not end.
CliResult finish(Process& process);

}  // namespace tfdude::testing
