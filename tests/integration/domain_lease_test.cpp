// The domains of tests: others in one are noticed.

#include "support/domain_lease.hpp"

#include <csignal>
#include <iostream>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <sys/socket.h>
#include <unistd.h>

#include <netinet/in.h>

#include "support/catch.hpp"
#include "support/process.hpp"

namespace tfdude::testing {
namespace {

// Beyond those of other tests, and different ones for tests that run at the same time.
constexpr Domains kTwo{230, 2};
constexpr Domains kOthers{228, 2};

/// What is printed meanwhile, also if a test fails.
class Printed {
 public:
  Printed() : before_(std::cout.rdbuf(text_.rdbuf())) {}
  ~Printed() { std::cout.rdbuf(before_); }
  Printed(const Printed&) = delete;
  Printed& operator=(const Printed&) = delete;

  [[nodiscard]] std::string text() const { return text_.str(); }

 private:
  std::ostringstream text_;
  std::streambuf* const before_;
};

/// Receives the announcements of a domain, as a participant.
class Listener {
 public:
  explicit Listener(std::uint32_t domain) : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    const int yes = 1;
    setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(announcement_port(domain));
    REQUIRE(bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  }
  ~Listener() { close(socket_); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

 private:
  const int socket_;
};

}  // namespace

TEST_CASE("domain lease: a domain with a participant of others is not taken") {
  std::optional<Listener> first(kTwo.first);
  {
    const DomainLease lease(kTwo);
    CHECK(lease.number() == kTwo.first + 1);
    CHECK_THROWS_WITH(DomainLease(kTwo), ContainsSubstring("domain 230 has sockets of process " +
                                                           std::to_string(getpid())));
  }
  const Listener second(kTwo.first + 1);
  CHECK_THROWS_WITH(DomainLease(kTwo),
                    ContainsSubstring("domain 230") && ContainsSubstring("domain 231"));
  first.reset();
  CHECK(DomainLease(kTwo).number() == kTwo.first);
}

TEST_CASE("domain lease: who enters a domain meanwhile is named") {
  {
    const Printed printed;
    {
      const DomainLease lease(kOthers);
      const Listener own(lease.number());  // of the test itself: no warning
    }
    CHECK(printed.text().empty());
  }
  std::string text;
  std::string name;
  {
    const Printed printed;
    std::optional<DomainLease> lease(kOthers);
    // A process that is no child of this one.
    Process other({"/usr/bin/setsid", "--fork", "/usr/bin/python3", "-c",
                   "import os, socket, time\n"
                   "s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)\n"
                   "s.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)\n"
                   "s.bind(('', " +
                       std::to_string(announcement_port(lease->number())) +
                       "))\n"
                       "print('bound', os.getpid(), flush=True)\n"
                       "time.sleep(20)"});
    const auto line = other.wait_for_line("bound ", in_time());
    REQUIRE(line);
    name = "process " + line->substr(line->find(' ') + 1) + " (python3)";
    lease.reset();
    text = printed.text();
    kill(std::stoi(line->substr(line->find(' ') + 1)), SIGKILL);
  }
  CHECK_THAT(text, ContainsSubstring(name));
}

}  // namespace tfdude::testing
