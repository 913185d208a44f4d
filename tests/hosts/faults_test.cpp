// Hosts with lost packets and cut links.

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "hosts/robot_hosts.hpp"

namespace tfdude {
namespace {

using std::chrono::duration;
using std::chrono::seconds;
using testing::Clock;
using testing::eventually;
using testing::kX;
using testing::kY;
using testing::lookups_diff;
using testing::RobotHosts;
using testing::structure_diff;

constexpr int kCalls = 1000;

/// How long a link is cut.
seconds cut_time() {
  const char* given = std::getenv("TFDUDE_TEST_CUT");
  return seconds(given != nullptr ? std::stoi(given) : 10);
}

bool unreachable(Client& client, const std::string& a, const std::string& b) {
  const auto lost = client.lookup(a, b);
  return !lost && lost.error().code == Errc::kUnreachable;
}

}  // namespace

TEST_CASE("hosts: calls are answered while packets are lost in both directions") {
  if (testing::skip_without_hosts()) return;
  RobotHosts r(false);
  r.start_daemons();
  auto client = Client::open(r.options()).value();
  REQUIRE(eventually([&] { return structure_diff(client, r.oracle).empty(); }));
  for (const int loss : {0, 2, 10}) {
    const auto lost_before = r.hosts.lost();
    if (loss > 0) r.hosts.lose(loss);
    std::vector<double> times;
    int failed = 0;
    for (int i = 0; i < kCalls; ++i) {
      const auto begin = Clock::now();
      if (!client.lookup("arm_1", "hand_left")) ++failed;  // of arms alone
      times.push_back(duration<double, std::milli>(Clock::now() - begin).count());
    }
    std::sort(times.begin(), times.end());
    const auto lost = r.hosts.lost() - lost_before;
    std::printf("loss %2d %%: p50 %7.3f ms, p99 %7.3f ms, longest %7.3f ms, packets lost %llu\n",
                loss, times[kCalls / 2], times[kCalls * 99 / 100], times.back(),
                static_cast<unsigned long long>(lost));
    CHECK(failed == 0);
    CHECK((lost > 0) == (loss > 0));
  }
  CHECK(lookups_diff(client, r.oracle) == "");
}

TEST_CASE("hosts: replicas become equal again after a link was cut") {
  if (testing::skip_without_hosts()) return;
  const bool by_server = GENERATE(false, true);
  const seconds cut = cut_time();
  RobotHosts r(by_server);
  if (by_server) r.start_server();
  r.start_daemons();
  auto near = Client::open(r.options()).value();
  auto far = r.open_client(RobotHosts::kArms);
  for (Client* client : {&near, &far}) {
    REQUIRE(eventually([&] { return structure_diff(*client, r.oracle).empty(); }));
    // By then each has discovered all that it is going to ask, because a server that is cut off
    // does not help to discover others.
    CHECK(lookups_diff(*client, r.oracle) == "");
  }
  const auto begin = Clock::now();
  r.hosts.cut(RobotHosts::kArms);
  REQUIRE(eventually([&] { return unreachable(near, "world", "hand_left"); }));
  REQUIRE(eventually([&] { return unreachable(far, "hand_left", "world"); }));
  // Both sides go on.
  REQUIRE(near.add("lamp", "camera", kX));
  REQUIRE(near.remove("tool"));
  REQUIRE(far.add("marker", "arm_right", kY));
  REQUIRE(far.move("hand_left", "arm_2"));
  r.oracle.add("lamp", "camera", kX);
  r.oracle.remove("tool");
  r.oracle.add("marker", "arm_right", kY);
  r.oracle.move("hand_left", "arm_2");
  CHECK(structure_diff(near, r.oracle) != "");
  CHECK(structure_diff(far, r.oracle) != "");
  REQUIRE(eventually([&] { return Clock::now() >= begin + cut; }));
  r.hosts.heal(RobotHosts::kArms);
  const auto healed = Clock::now();
  for (Client* client : {&near, &far}) {
    REQUIRE(eventually([&] { return structure_diff(*client, r.oracle).empty(); }));
  }
  const duration<double> equal = Clock::now() - healed;
  for (Client* client : {&near, &far}) {
    REQUIRE(eventually([&] { return lookups_diff(*client, r.oracle).empty(); }));
  }
  const duration<double> answered = Clock::now() - healed;
  std::printf(
      "cut for %lld s: replicas equal %.2f s after it was healed, all calls answered %.2f s "
      "after\n",
      static_cast<long long>(cut.count()), equal.count(), answered.count());
  CHECK(equal.count() < 3.0);
  CHECK(answered.count() < 3.0);
}

}  // namespace tfdude
