#pragma once

// Two robot arms, each with an owner of its own, of which one has a gripper.

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/networks.hpp"
#include "support/pose_diff.hpp"
#include "support/process.hpp"
#include "support/random.hpp"

namespace tfdude::testing {

using namespace std::chrono_literals;

inline constexpr std::int64_t kMs = 1'000'000;
inline constexpr std::int64_t kEnd = 3000;  // of the samples [ms]

inline Time ms(std::int64_t milliseconds) { return time_of(milliseconds * kMs); }

inline Query query(std::int64_t milliseconds) {
  Query query;
  query.at = ms(milliseconds);
  return query;
}

inline EdgeTiming long_history() {
  EdgeTiming timing;
  timing.span = std::chrono::hours(1);
  timing.count = 100'000;
  timing.max_ahead = std::chrono::nanoseconds::max();
  return timing;
}

inline Correlation shared_source(Random& random) {
  return {false,
          {{"supply", false,
            Loading::NullaryExpr(6, 2, [&](auto, auto) { return 0.01 * random.normal(); })}},
          {}};
}

inline std::vector<FrameSpec> frames_of_arm1() {
  Random random(7);
  FrameSpec finger{"finger", "gripper", along_x(0)};
  finger.timing = long_history();
  FrameSpec gripper{"gripper", "flange1", random.transform(1.0, 0.01, 0.01)};
  gripper.correlation = shared_source(random);
  return {{"base1", "", {}},
          {"flange1", "base1", random.transform(1.0, 0.01, 0.01)},
          gripper,
          finger,
          {"pad", "finger", random.transform(1.0, 0.01, 0.01)}};
}

inline std::vector<FrameSpec> frames_of_arm2() {
  Random random(8);
  FrameSpec flange{"flange2", "base2", random.transform(1.0, 0.01, 0.01)};
  flange.correlation = shared_source(random);
  return {{"base2", "base1", random.transform(1.0, 0.01, 0.01)}, flange};
}

inline std::string owner_of(Client& client, const std::string& id) {
  for (const Frame& frame : client.frames().value()) {
    if (frame.id == id) return frame.partition;
  }
  return "none";
}

// Two arms with the gripper at the first, a camera of a third owner on it, and a client.
struct Arms {
  explicit Arms(Join how, const NodeOptions& options = {}, Milliseconds timeout = 2s)
      : join(std::move(how)) {
    arm1.emplace(Node::open(join("arm1"), "arm1", frames_of_arm1(), options).value());
    arm2.emplace(Node::open(join("arm2"), "arm2", frames_of_arm2(), options).value());
    eye.emplace(Node::open(join("eye"), "eye", {{"camera", "gripper", along_x(1)}}).value());
    Options patient;
    patient.timeout = timeout;
    client.emplace(Client::open(join(""), patient).value());
    Random random(9);
    Covariance covariance;
    for (std::int64_t t = 0; t <= kEnd; t += 10) {
      Transform X = along_x(0.001 * static_cast<double>(t));
      if (t % 50 == 0) covariance = random.covariance();
      X.covariance = covariance;
      REQUIRE(arm1->update("finger", X, ms(t)));
    }
    for (Client* one : clients()) {
      REQUIRE(one->exists("pad"));
      REQUIRE(one->exists("camera"));
      REQUIRE(one->exists("flange2"));
    }
  }

  [[nodiscard]] std::vector<Client*> clients() {
    std::vector<Client*> all;
    if (arm1) all.push_back(&*arm1);
    if (arm2) all.push_back(&*arm2);
    all.push_back(&*eye);
    all.push_back(&*client);
    return all;
  }

  Join join;
  std::optional<Node> arm1;
  std::optional<Node> arm2;
  std::optional<Node> eye;
  std::optional<Client> client;
};

// What the past and the present of several paths are.
inline std::vector<Transform> seen(Client& client) {
  std::vector<Transform> all;
  const auto add = [&](const auto& X) {
    INFO(outcome(X) << (X ? "" : ": " + X.error().message));
    REQUIRE(X);
    all.push_back(*X);
  };
  for (const std::int64_t t : {0, 5, 17, 1234, 2000, 2996, 3000}) {
    add(client.lookup("base1", "pad", query(t)));
    add(client.lookup("pad", "flange2", query(t)));  // with a source that both ends have
  }
  for (const char* end : {"flange2", "camera", "pad", "gripper"}) add(client.lookup("base1", end));
  add(client.lookup("finger", "camera"));
  return all;
}

inline std::string difference(const std::vector<Transform>& actual,
                              const std::vector<Transform>& expected) {
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const auto diff = transform_diff(actual[i], expected[i], 1e-9);
    if (!diff.empty()) return "value " + std::to_string(i) + ": " + diff;
  }
  return "";
}

// Whether all know it as the owner now.
inline bool agree(Arms& arms, const std::string& owner) {
  const auto all = arms.clients();
  return std::all_of(all.begin(), all.end(), [&](Client* one) {
    return owner_of(*one, "gripper") == owner && owner_of(*one, "pad") == owner;
  });
}

inline bool is_settled(Arms& arms, const std::string& owner) {
  return eventually([&] { return agree(arms, owner); });
}

// The owner, and nobody else, accepts changes.
inline void check_writable(Arms& arms, double x) {
  REQUIRE(eventually([&] { return arms.client->update("gripper", along_x(x)).has_value(); }));
  for (Client* one : arms.clients()) {
    CHECK(x_of(one->lookup("flange1", "gripper")) == x);
  }
}

}  // namespace tfdude::testing
