// A program of another vendor's DDS tells a daemon of a joint and an edge.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>

#include "tfdude/client/client.hpp"

#include "support/catch.hpp"
#include "support/test_domain.hpp"

namespace tfdude {
namespace {

using testing::Approx;
using testing::eventually;

// On the loopback interface, as the daemon is.
const std::string kLoopback =
    "CYCLONEDDS_URI=<CycloneDDS><Domain><General><Interfaces>"
    "<NetworkInterface address=\"127.0.0.1\" multicast=\"true\"/>"
    "</Interfaces></General></Domain></CycloneDDS>";

double elbow(Client& client) {
  const auto joints = client.joints("arm");
  if (!joints) return std::nan("");
  const auto found = std::find_if(joints->begin(), joints->end(), [](const JointInfo& joint) {
    return joint.name == "elbow_joint" && joint.measured;
  });
  return found != joints->end() ? found->position : std::nan("");
}

}  // namespace

TEST_CASE("other dds: a joint and an edge that Cyclone DDS publishes reach a daemon") {
  const testing::TestDomain domain;
  const testing::Process daemon = domain.serve(TFDUDE_EXAMPLES "/arm/arm.yaml");
  Client client = Client::open(domain.options()).value();
  const Time before = std::chrono::system_clock::now();
  testing::Process publisher(
      {"/usr/bin/env", kLoopback, TFDUDE_CYCLONE_PUBLISH, std::to_string(domain.number())});
  const auto published = testing::finish(publisher);
  INFO(published.err);
  REQUIRE(published.status == 0);

  CHECK(eventually([&] { return elbow(client) == 0.5; }));
  const auto forearm = client.lookup("upper_arm_link", "forearm_link", Query{});
  REQUIRE(forearm);
  CHECK(forearm->stamp >= before);
  CHECK(forearm->covariance.of_specified().stddev()[5] == Approx(1e-3));

  const auto tool = [&] { return client.lookup("wrist_3_link", "tool0"); };
  CHECK(eventually([&] { return tool()->pose.translation().z() == 0.2; }));
  CHECK(tool()->covariance.of_specified().stddev()[0] == Approx(1e-3));
  CHECK(tool()->covariance.of_specified().stddev()[5] == Approx(1e-2));
}

}  // namespace tfdude
