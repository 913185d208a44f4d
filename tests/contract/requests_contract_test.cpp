// Requests that are lost, and requests that are repeated, over each transport.

#include <atomic>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/late_pages.hpp"
#include "support/lossy_requests.hpp"
#include "support/networks.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::Join;
using testing::joined_by;
using testing::LossyRequests;
using testing::Random;

Transform ahead(double metres) {
  return {Pose::trusted(Eigen::Quaterniond::Identity(), {metres, 0, 0}), Covariance()};
}

Options patient() {
  Options options;
  options.timeout = Milliseconds(20000);
  return options;
}

}  // namespace

TEST_CASE("a change whose request is lost many times is applied while other threads continue") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  constexpr int kThreads = 3;
  constexpr int kLost =
      8;  // sendings of each request of the unlucky thread, beyond a second in all
  auto owner =
      Node::open(join("arms"), "arms", {{"arm", "", {}}, {"slow", "arm", {}}}, patient()).value();
  std::map<std::uint32_t, int> sendings;
  const auto loses = [&sendings](const Request& request) {
    return request.id == "slow" && std::holds_alternative<PartialUpdateRequest>(request.body) &&
           ++sendings[request.sequence] <= kLost;
  };
  auto client = Client::open(std::make_unique<LossyRequests>(join(""), loses), patient()).value();
  REQUIRE(client.exists("slow"));
  std::atomic<bool> done{false};
  std::atomic<int> others{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i) {
    threads.emplace_back([&] {
      // Fewer than the replies that the owner keeps; beyond that it may answer with a time-out.
      while (!done && others < 20'000) {
        others += client.update("arm", ahead(1)).has_value() ? 1 : 0;
      }
    });
  }
  const auto updated = client.update_partial({{"slow", {Eigen::Vector3d(5, 0, 0)}}});
  done = true;
  for (std::thread& thread : threads) thread.join();
  INFO((updated ? "" : updated.error().message) << ", others " << others);
  CHECK(updated.has_value());
  CHECK(others > 256);
  CHECK(owner.lookup("arm", "slow").value().pose.translation().x() == 5);
}

TEST_CASE("a frame that its owner has added is not called unknown before its page arrives") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  const Node arms = Node::open(join("arms"), "arms", {{"arm", "", {}}}).value();
  auto late_transport = std::make_unique<testing::LatePages>(join(""));
  testing::LatePages& late = *late_transport;
  Options options;
  options.timeout = Milliseconds(200);
  Client client = Client::open(std::move(late_transport), options).value();
  REQUIRE(client.exists("arm"));
  REQUIRE_FALSE(client.exists("hand"));
  late.hold("arms");
  REQUIRE(client.add("hand", "arm", ahead(1)));
  const auto early = client.lookup("arm", "hand");
  REQUIRE_FALSE(early);
  CHECK(early.error().code == Errc::kTimeout);
  CHECK_THAT(early.error().message, testing::ContainsSubstring("'arms'"));
  CHECK_THAT(early.error().message, testing::ContainsSubstring("'hand'"));
  late.let_through();
  CHECK(client.lookup("arm", "hand"));
  CHECK(client.lookup("arm", "tool").error().code == Errc::kUnknownEnd);
}

TEST_CASE("a partial update changes the given parts at the owner and keeps the others") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Random random(0x9a75);
  const Transform X_PC = random.transform();
  auto owner =
      Node::open(join("arms"), "arms", {{"arm", "", {}}, {"hand", "arm", X_PC}}, patient()).value();
  auto client = Client::open(join(""), patient()).value();
  const auto hand = [&] { return client.lookup("arm", "hand").value(); };
  const Eigen::Vector3d there(1, 2, 3);
  REQUIRE(client.update_partial({{"hand", {there}}}));
  const Transform placed{*Pose::create(X_PC.pose.rotation(), there), X_PC.covariance};
  CHECK(testing::transform_diff(hand(), placed, 1e-12) == "");
  const Transform other = random.transform();
  REQUIRE(client.update_partial({{"hand", {{}, other.pose.rotation()}}}));
  REQUIRE(owner.update_partial({{"hand", {{}, {}, other.covariance}}}));
  const Transform all{*Pose::create(other.pose.rotation(), there), other.covariance};
  CHECK(testing::transform_diff(hand(), all, 1e-12) == "");
  const auto refused = client.update_partial({{"hand", {Eigen::Vector3d(0, 2e9, 0)}}});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::kInvalidInput);
  CHECK(testing::transform_diff(hand(), all, 1e-12) == "");
}

TEST_CASE("an owner rejects and counts a sample from the future") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  auto owner =
      Node::open(join("arms"), "arms", {{"arm", "", {}}, {"hand", "arm", {}}}, patient()).value();
  auto client = Client::open(join(""), patient()).value();
  const auto refused = client.update("hand", ahead(1), time_of(9'000'000'000'000'000'000));
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::kInvalidInput);
  CHECK_THAT(refused.error().message, testing::ContainsSubstring("2255-03-14"));
  REQUIRE(client.history("hand").value().size() == 1);
  CHECK(client.history("hand").value().at(0).refused_ahead == 1);
  REQUIRE(client.update(
      "hand", ahead(2),
      std::chrono::time_point_cast<Time::duration>(std::chrono::system_clock::now())));
  CHECK(client.lookup("arm", "hand").value().pose.translation().x() == 2);
}

}  // namespace tfdude
