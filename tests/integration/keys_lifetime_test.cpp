// Programs with keys whose peers die, and keys that expire or are revoked while they run.

#include <csignal>
#include <filesystem>
#include <optional>
#include <string>

#include "tfdude/client/client.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/key_store.hpp"
#include "support/test_domain.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;

using testing::ContainsSubstring;
using testing::eventually;
using testing::Process;
using testing::TestDomain;
using testing::TestKeys;

Time now() {
  return std::chrono::time_point_cast<Time::duration>(std::chrono::system_clock::now());
}

struct SecuredPair {
  SecuredPair() : keys(now() - Days(10)) {
    keys.add("base", testing::daemon_of("base"));
    keys.add("eye", testing::looking());
    base.emplace(serve("base", "frames: [{id: base}]\n"));
  }
  [[nodiscard]] Process start(const std::string& name, const std::string& frames) const {
    const std::string config = files.write(name + ".yaml", "partition: " + name + "\n" + frames);
    return domain.start_daemon({"--keys", keys.path(name), "--config", config});
  }
  [[nodiscard]] Process serve(const std::string& name, const std::string& frames) const {
    Process daemon = start(name, frames);
    testing::await_ready(daemon);
    return daemon;
  }
  [[nodiscard]] Client client(const std::string& identity,
                              Milliseconds timeout = Milliseconds(20000)) const {
    Options options = domain.options(timeout);
    options.keys = keys.path(identity);
    return Client::open(options).value();
  }

  TestDomain domain;
  TestKeys keys;
  testing::TemporaryDirectory files;
  std::optional<Process> base;
};

const std::string kHand = "frames: [{id: hand, parent: base, xyz: [1, 0, 0]}]\n";

}  // namespace

// Nobody but DDS can read the acknowledgements of encrypted messages, and DDS keeps the killed
// process for 30 s.
TEST_CASE("keys: neither a flush nor the end of a client waits for a process that was killed") {
  SecuredPair robot;
  robot.keys.add("arm", testing::daemon_of("arm"));
  Roles roles = testing::streaming("arm");
  roles.look = true;
  robot.keys.add("controller", roles);
  Process arm = robot.serve("arm", kHand);
  std::optional<Client> client = robot.client("controller");
  const auto publish = [&](double x) {
    return client->publish({{"hand", testing::along_x(x)}}).has_value();
  };
  REQUIRE(eventually([&] { return publish(1); }));
  REQUIRE(client->flush(20'000ms));
  arm.signal(SIGKILL);
  REQUIRE(eventually([&] { return !publish(2); }));
  Process again = robot.serve("arm", kHand);
  REQUIRE(eventually([&] { return publish(3); }));
  using Clock = std::chrono::steady_clock;
  const auto returned = Clock::now();
  CHECK(client->flush(20'000ms));
  CHECK(Clock::now() - returned < 10s);
  CHECK(client->lookup("base", "hand").value().pose.translation().x() == 3);
  REQUIRE(publish(4));
  client.reset();
  CHECK(Clock::now() - returned < 15s);
  Client other = robot.client("eye");
  CHECK(other.lookup("base", "hand").value().pose.translation().x() == 4);
}

TEST_CASE("keys: an owner whose keys expire keeps whom it has met, and meets nobody else") {
  SecuredPair robot;
  constexpr Days kLifetime{5};
  constexpr std::chrono::seconds kLeft{6};
  REQUIRE(add_identity(robot.keys.path(), "arm", testing::daemon_of("arm"), kLifetime,
                       now() - kLifetime + kLeft));
  Process arm = robot.serve("arm", kHand);
  Client early = robot.client("eye");
  REQUIRE(early.lookup("base", "hand"));
  REQUIRE(eventually([&] { return !find_keys(robot.keys.path("arm"), now()); }));
  CHECK(early.lookup("base", "hand"));
  CHECK(arm.runs());
  Client late = robot.client("eye", Milliseconds(2000));
  CHECK(late.exists("base"));
  const auto X = late.lookup("base", "hand");
  REQUIRE_FALSE(X);
  INFO(X.error().message);
  CHECK((X.error().code == Errc::kNotPermitted || X.error().code == Errc::kUnreachable ||
         X.error().code == Errc::kTimeout || X.error().code == Errc::kUnknownEnd));
  CHECK(early.lookup("base", "hand"));
  Process again = robot.start("arm", kHand);
  CHECK(again.wait(testing::in_time()).value_or(0) != 0);
  CHECK_THAT(again.err(), ContainsSubstring("expired"));
}

TEST_CASE("keys: a revoked client is rejected by each owner that has started since") {
  SecuredPair robot;
  robot.keys.add("arm", testing::daemon_of("arm"));
  robot.keys.add("stolen", testing::moving("arm"));
  std::optional<Process> arm(robot.serve("arm", kHand));
  // A copy of the directory stays when the identity is revoked.
  const std::string copy = robot.files.path() + "/copy";
  std::filesystem::copy(robot.keys.path("stolen"), copy);
  Options options = robot.domain.options(Milliseconds(2000));
  options.keys = copy;
  Client thief = Client::open(options).value();
  REQUIRE(thief.update("hand", {*Pose::create(Eigen::Quaterniond::Identity(), {2, 0, 0}), {}}));
  REQUIRE(revoke_identity(robot.keys.path(), "stolen", now()));
  // Fast DDS reads the list when a participant is created.
  CHECK(thief.update("hand", {*Pose::create(Eigen::Quaterniond::Identity(), {3, 0, 0}), {}}));
  arm->kill();
  arm.emplace(robot.serve("arm", kHand));
  CHECK_FALSE(thief.update("hand", {*Pose::create(Eigen::Quaterniond::Identity(), {4, 0, 0}), {}}));
  const auto fresh = Client::open(options);
  if (fresh) {
    Client client = Client::open(options).value();
    CHECK_FALSE(
        client.update("hand", {*Pose::create(Eigen::Quaterniond::Identity(), {5, 0, 0}), {}}));
  }
  const auto X = robot.client("eye").lookup("base", "hand");
  REQUIRE(X);
  // As configured: this daemon stores nothing.
  CHECK(X->pose.translation().x() == 1);
}

}  // namespace tfdude
