// What a daemon tells the service manager that has started it, and the journal.

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <fcntl.h>
#include <string>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/un.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include "tfdude/client/client.hpp"

#include "support/catch.hpp"
#include "support/test_domain.hpp"

namespace tfdude {
namespace {

using testing::await_ready;
using testing::CliResult;
using testing::Clock;
using testing::ContainsSubstring;
using testing::Process;
using testing::TemporaryDirectory;
using testing::TestDomain;

constexpr const char* kFrame = "partition: arm\nframes:\n  - id: arm\n";
const std::vector<std::string> kArm = {"--partition", "arm", "--no-state"};

// The socket of a service manager. Its address is a path or, after '@', an abstract name.
class NotifySocket {
 public:
  explicit NotifySocket(const std::string& name) : file_(socket(AF_UNIX, SOCK_DGRAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    name.copy(address.sun_path, sizeof(address.sun_path) - 1);
    if (name[0] == '@') address.sun_path[0] = 0;
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
    REQUIRE(bind(file_, reinterpret_cast<const sockaddr*>(&address), length) == 0);
  }
  ~NotifySocket() { close(file_); }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;

  // The next message; empty if there is none in time.
  [[nodiscard]] std::string next(std::chrono::seconds wait = std::chrono::seconds(30)) const {
    const timeval limit{wait.count(), 0};
    setsockopt(file_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
    std::array<char, 256> text{};
    const auto length = recv(file_, text.data(), text.size(), 0);
    return {text.data(), static_cast<std::size_t>(length < 0 ? 0 : length)};
  }

 private:
  int file_;
};

// Starts a daemon whose standard error is the journal, as far as it can see.
CliResult run_with_journal(const TestDomain& domain, const std::string& stream,
                           const std::vector<std::string>& arguments) {
  Process daemon = domain.start_daemon(
      arguments, {"/bin/sh", "-c", "JOURNAL_STREAM=" + stream + " exec \"$@\"", "sh"});
  (void)daemon.wait_for_line("ready", testing::in_time());
  daemon.signal(SIGTERM);
  return testing::finish(daemon);
}

constexpr const char* kItself = "$(stat -L -c %d:%i /proc/self/fd/2)";

}  // namespace

TEST_CASE("service: the daemon reports that it serves, is alive and stops") {
  const TestDomain domain;
  const TemporaryDirectory files;
  const std::string name = GENERATE("/notify", "@tfdude-test-");
  const std::string address =
      name[0] == '@' ? name + std::to_string(getpid()) : files.path() + name;
  const NotifySocket manager(address);
  Process daemon = domain.start_daemon(
      kArm, {"/usr/bin/env", "NOTIFY_SOCKET=" + address, "WATCHDOG_USEC=300000"});
  CHECK(manager.next() == "READY=1\nSTATUS=serving partition 'arm'");
  CHECK(daemon.wait_for_line("ready", testing::in_time()));
  for (int i = 0; i < 3; ++i) CHECK(manager.next() == "WATCHDOG=1");
  daemon.signal(SIGTERM);
  std::string last = manager.next();
  while (last == "WATCHDOG=1") last = manager.next();
  CHECK(last == "STOPPING=1");
  CHECK(testing::finish(daemon).status == 0);
}

TEST_CASE("service: without a watchdog of its own the daemon reports only its start and its end") {
  const TestDomain domain;
  const TemporaryDirectory files;
  const std::string address = files.path() + "/notify";
  const NotifySocket manager(address);
  Process daemon = domain.start_daemon(
      kArm, {"/usr/bin/env", "NOTIFY_SOCKET=" + address, "WATCHDOG_USEC=30000", "WATCHDOG_PID=1"});
  CHECK_THAT(manager.next(), ContainsSubstring("READY=1"));
  CHECK(manager.next(std::chrono::seconds(1)).empty());
  daemon.signal(SIGTERM);
  CHECK(manager.next() == "STOPPING=1");
}

TEST_CASE("service: a daemon that cannot serve is never ready") {
  const TestDomain domain;
  const TemporaryDirectory files;
  const std::string address = files.path() + "/notify";
  const NotifySocket manager(address);
  Process daemon = domain.start_daemon({"--config", "/nowhere/arm.yaml"},
                                       {"/usr/bin/env", "NOTIFY_SOCKET=" + address});
  CHECK(testing::finish(daemon).status == 2);
  CHECK(manager.next(std::chrono::seconds(1)).empty());
}

TEST_CASE("service: while its loop hangs the daemon does not feed the watchdog") {
#ifndef TFDUDE_SLOW_SYNC
  WARN("SKIPPED: a library cannot be preloaded into a program with sanitizers");
#else
  const TestDomain domain;
  const TemporaryDirectory files;
  const std::string address = files.path() + "/notify";
  const NotifySocket manager(address);
  Process daemon = domain.start_daemon(
      {"--config", files.write("arm.yaml", kFrame), "--sync", "--state", files.path()},
      {"/usr/bin/env", "LD_PRELOAD=" TFDUDE_SLOW_SYNC, "TFDUDE_SYNC_MS=900",
       "NOTIFY_SOCKET=" + address, "WATCHDOG_USEC=300000"});
  await_ready(daemon);
  CHECK_THAT(manager.next(), ContainsSubstring("READY=1"));
  CHECK(manager.next() == "WATCHDOG=1");
  auto client = Client::open(domain.options()).value();
  const auto deadline = testing::in_time();
  Result<void> added;
  std::thread changing([&] { added = client.add("hand", "arm", {}); });
  // The loop waits for the disk meanwhile, and then lives again.
  constexpr std::chrono::milliseconds kHung{800};
  Clock::duration longest{0};
  for (auto last = Clock::now(); longest < kHung && last < deadline; last = Clock::now()) {
    if (manager.next() != "WATCHDOG=1") break;
    longest = std::max(longest, Clock::now() - last);
  }
  changing.join();
  CHECK(added);
  CHECK(longest >= kHung);
#endif
}

TEST_CASE("service: a daemon whose disk hangs ends all the same, and has kept what it confirmed") {
#ifndef TFDUDE_SLOW_SYNC
  WARN("SKIPPED: a library cannot be preloaded into a program with sanitizers");
#else
  const TestDomain domain;
  const TemporaryDirectory files;
  const std::vector<std::string> arguments = {"--config", files.write("arm.yaml", kFrame), "--sync",
                                              "--state", files.path()};
  Process daemon = domain.start_daemon(
      arguments, {"/usr/bin/env", "LD_PRELOAD=" TFDUDE_SLOW_SYNC, "TFDUDE_SYNC_MS=600000",
                  "TFDUDE_SYNC_IF=" + files.path() + "/hang"});
  await_ready(daemon);
  REQUIRE(domain.cli({"add", "kept", "--parent", "arm"}).status == 0);
  (void)files.write("hang", "");
  auto client = Client::open(domain.options(tfdude::Milliseconds(500))).value();
  CHECK_FALSE(client.add("lost", "arm", {}));
  daemon.signal(SIGTERM);
  const auto status = daemon.wait(Clock::now() + std::chrono::seconds(12));
  REQUIRE(status);
  CHECK(*status == 1);
  CHECK_THAT(daemon.err(), ContainsSubstring("did not stop in time"));
  Process again = domain.start_daemon(arguments);
  await_ready(again);
  CHECK(domain.cli({"exists", "kept"}).status == 0);
#endif
}

TEST_CASE("service: a signal ends a daemon that waits for its configuration") {
  const TestDomain domain;
  const TemporaryDirectory files;
  const std::string fifo = files.path() + "/arm.yaml";
  REQUIRE(mkfifo(fifo.c_str(), 0600) == 0);
  Process daemon = domain.start_daemon({"--config", fifo, "--no-state"});
  int writer = -1;  // can be opened once the daemon reads
  REQUIRE(testing::eventually([&] {
    writer = open(fifo.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
    return writer >= 0;
  }));
  daemon.signal(SIGTERM);
  CHECK(daemon.wait(testing::in_time()) == 128 + SIGTERM);
  close(writer);
}

TEST_CASE("service: lines in the journal have a level, and neither time nor name") {
  const TestDomain domain;
  const CliResult served = run_with_journal(domain, kItself, kArm);
  CHECK(served.status == 0);
  CHECK_THAT(served.err, ContainsSubstring("<6>serving partition 'arm' in domain "));
  CHECK_THAT(served.err, ContainsSubstring("\n<6>stopping on signal 15\n"));
  const std::vector<std::string> wrong = {"--config", "/nowhere/arm.yaml"};
  CHECK(run_with_journal(domain, kItself, wrong).err.rfind("<3>/nowhere/arm.yaml", 0) == 0);
  // Standard error may be redirected from the journal that systemd has announced.
  CHECK(run_with_journal(domain, "1:1", wrong).err.rfind("<3>", 0) == std::string::npos);
}

}  // namespace tfdude
