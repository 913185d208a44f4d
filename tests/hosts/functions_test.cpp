// The service over several hosts: network namespaces, each with its own address.

#include "tfdude/client/node.hpp"

#include "hosts/robot_hosts.hpp"
#include "support/german_locale.hpp"

namespace tfdude {
namespace {

using testing::eventually;
using testing::kX;
using testing::kY;
using testing::lookups_diff;
using testing::Process;
using testing::RobotHosts;
using testing::structure_diff;

void check_agreement(RobotHosts& r, Client& client) {
  CHECK(eventually([&] { return structure_diff(client, r.oracle).empty(); }));
  CHECK(lookups_diff(client, r.oracle) == "");
}

}  // namespace

TEST_CASE("hosts: a client on a fourth host uses the frames of three others") {
  if (testing::skip_without_hosts()) return;
  const bool by_server = GENERATE(false, true);
  RobotHosts r(by_server);
  if (by_server) r.start_server();
  r.start_daemons();
  auto client = Client::open(r.options()).value();
  auto witness = r.open_client(RobotHosts::kArms);
  check_agreement(r, client);
  const auto path = client.path("world", "tool");
  REQUIRE(path);
  CHECK(path->size() == 3);
  REQUIRE(client.add("marker", "tool", kX));
  REQUIRE(client.add("lamp", "camera", kY, "arms"));
  REQUIRE(client.update("arm_1", kY));
  REQUIRE(client.move("tool", "arm_2"));
  REQUIRE(client.remove("arm_right"));
  r.oracle.add("marker", "tool", kX);
  r.oracle.add("lamp", "camera", kY);
  r.oracle.update("arm_1", kY);
  r.oracle.move("tool", "arm_2");
  r.oracle.remove("arm_right");
  for (Client* each : {&client, &witness}) check_agreement(r, *each);
  r.oracle.update("robot_1", kX);
  r.oracle.update("tool", kY);
  REQUIRE(eventually([&] {
    return client.publish({{"robot_1", kX}, {"tool", kY}}) &&
           lookups_diff(witness, r.oracle).empty();
  }));
  // A process or client that joins late learns all of it.
  auto late = r.open_client(RobotHosts::kTools);
  check_agreement(r, late);
  const auto answer = r.cli(RobotHosts::kServer, {"lookup", "world", "marker"});
  INFO(answer.err);
  CHECK(answer.status == 0);
  for (const Process* daemon : {&*r.robot, &*r.arms, &*r.tools}) {
    CHECK_THAT(testing::maps_of(daemon->pid()), !testing::ContainsSubstring("/dev/shm"));
  }
}

TEST_CASE("hosts: a discovery server may start late and restart") {
  if (testing::skip_without_hosts()) return;
  RobotHosts r(true);
  r.start_daemons();
  auto early = Client::open(r.options()).value();
  r.start_server_again();
  check_agreement(r, early);
  r.end_server();
  // Participants that know each other continue without it.
  REQUIRE(early.add("marker", "tool", kX));
  r.oracle.add("marker", "tool", kX);
  check_agreement(r, early);
  r.start_server_again();
  auto late = r.open_client(RobotHosts::kArms);
  check_agreement(r, late);
}

TEST_CASE("hosts: a program with a German locale meets those of other hosts") {
  if (testing::skip_without_hosts()) return;
  const bool by_server = GENERATE(false, true);
  RobotHosts r(by_server);
  if (by_server) r.start_server();
  r.start_daemons();
  const testing::GermanLocale german;
  auto client = Client::open(r.options()).value();
  check_agreement(r, client);
  auto node = Node::open("german", {{"desk", "", {}}, {"cup", "desk", kX}}, r.options()).value();
  CHECK(node.lookup("world", "tool"));
  const auto answer = r.cli(RobotHosts::kArms, {"lookup", "desk", "cup"});
  INFO(answer.err);
  CHECK(answer.status == 0);
}

}  // namespace tfdude
