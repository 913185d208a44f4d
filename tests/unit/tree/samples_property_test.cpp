// Compares histories with a list of full samples: poses with covariances that are shared or not,
// positions of joints, late and replaced samples, limits, and a watcher of all of it.

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/math/interpolate.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using testing::outcome;
using testing::Random;
using testing::transform_diff;

struct Full {
  std::int64_t stamp = 0;
  Transform X;
  JointState state{};                // of a position
  std::optional<Transform> given{};  // before it was revised
};

Transform joint_value(const JointState& state) {
  return joint_transform(*state.joint, state.at.position, state.at.variance);
}

// Sorted by stamp.
class Reference {
 public:
  Reference(std::int64_t span, std::size_t count) : span_(span), count_(count) {}

  std::string add(const Full& sample) {
    const auto at = place(sample.stamp);
    if (at != all_.end() && at->stamp == sample.stamp) return "stamp_taken";
    const bool late = at != all_.end();
    if (late && sample.stamp < all_.back().stamp - span_) return "too_old";
    if (late && at == all_.begin() && all_.size() >= count_) return "too_old";
    all_.insert(at, sample);
    trim();
    return "ok";
  }
  void replace(const Full& sample) {
    const auto at = place(sample.stamp);
    if (at != all_.end() && at->stamp == sample.stamp) {
      const Transform given = at->given.value_or(at->X);
      *at = sample;
      at->given = given;
    } else {
      (void)add(sample);
    }
  }
  void clear() { all_.clear(); }
  [[nodiscard]] const std::vector<Full>& all() const { return all_; }

  [[nodiscard]] std::optional<Transform> at(std::int64_t t, std::int64_t beyond) const {
    if (all_.empty() || t < all_.front().stamp) return std::nullopt;
    const auto after = std::lower_bound(
        all_.begin(), all_.end(), t,
        [](const Full& sample, std::int64_t stamp) { return sample.stamp < stamp; });
    if (after != all_.end() && after->stamp == t) return after->X;
    const bool outside = after == all_.end();
    if (outside && (t - all_.back().stamp > beyond || all_.size() < 2)) return std::nullopt;
    const Full& b = outside ? all_.back() : *after;
    const Full& a = *(outside ? all_.end() - 2 : after - 1);
    if (outside && t - b.stamp > 100 * (b.stamp - a.stamp)) return std::nullopt;
    const double s = static_cast<double>(t - a.stamp) / static_cast<double>(b.stamp - a.stamp);
    const bool joint = a.state.joint != nullptr && a.state.joint == b.state.joint;
    if (joint) {
      const double period = a.state.period;
      JointPosition start = a.state.at;
      const double turns = std::round((b.state.at.position - start.position) / period);
      if (period > 0) start.position += turns * period;
      const JointPosition q =
          outside ? extrapolate(start, b.state.at, s, 0) : interpolate(start, b.state.at, s, 0);
      return joint_value({a.state.joint, q});
    }
    if (!outside) return interpolate(a.X, b.X, s);
    if (!a.given && !b.given) return extrapolate(a.X, b.X, s);
    // What an observation has found is an offset: the twist is that of the given samples.
    const Transform X0 = a.given.value_or(a.X);
    const Transform X1 = b.given.value_or(b.X);
    const Pose ahead = exp((s - 1) * log(X0.pose.inverse() * X1.pose));
    const Covariance of_twist = bound(X0.covariance.of_specified(), X1.covariance.of_specified());
    const Covariance offset = b.X.covariance.of_specified().transported(ahead.inverse());
    StatedCovariance sum =
        bound(offset, Covariance::trusted(Matrix6d((s - 1) * (s - 1) * of_twist.matrix())));
    sum.set_complete(b.X.covariance.complete() && X0.covariance.complete() &&
                     X1.covariance.complete());
    return Transform{b.X.pose * ahead, sum};
  }

 private:
  std::vector<Full>::iterator place(std::int64_t stamp) {
    return std::lower_bound(all_.begin(), all_.end(), stamp,
                            [](const Full& sample, std::int64_t t) { return sample.stamp < t; });
  }
  void trim() {
    while (all_.size() > count_ || all_.front().stamp < all_.back().stamp - span_) {
      all_.erase(all_.begin());
    }
  }

  std::int64_t span_;
  std::size_t count_;
  std::vector<Full> all_;
};

// One edge, its reference, and a watcher.
class Edge {
 public:
  Edge(Random& random, std::size_t count) : random_(random), reference_(3'000'000, count) {
    EdgeTiming timing;
    timing.span = std::chrono::nanoseconds(3'000'000);
    timing.count = count;
    timing.restart_after = 0;
    EdgeTiming more = timing;
    more.count = 10'000;  // also of values between positions that are far apart
    REQUIRE(watcher_.set_default_timing(more));
    for (Forest* forest : {&forest_, &watcher_}) {
      REQUIRE(forest->add("base", "", {}));
      REQUIRE(forest->add("edge", "base", {}));
    }
    REQUIRE(forest_.set_timing("edge", timing));
    edge_ = *forest_.find("edge");
    // A screw, whose error concerns all axes.
    joints_[0] = {{random.pose(), {}}, random.twist(1)};
    joints_[1] = prismatic_joint({random.pose(), {}}, random.direction());
    for (double& period : periods_) period = random.index(2) == 0 ? 0 : random.uniform(1, 9);
  }

  void step() {
    now_ += 1 + static_cast<std::int64_t>(random_.index(10'000));
    const std::size_t kind = random_.index(100);
    Full sample = value(now_);
    if (kind < 15) sample.stamp -= static_cast<std::int64_t>(random_.index(200'000));
    if (kind < 20 && kind >= 15 && !reference_.all().empty()) {
      sample = pose(reference_.all()[random_.index(reference_.all().size())].stamp);
      revise(sample);
    } else if (kind == 20) {
      REQUIRE(forest_.move("edge", "base"));
      reference_.clear();
    } else {
      const CorrelatedUpdate update{edge_, sample.X, nullptr, sample.state};
      REQUIRE(outcome(forest_.update_correlated({update}, time_of(sample.stamp))) ==
              reference_.add(sample));
    }
  }

  void compare() {
    const auto& all = reference_.all();
    const auto histories = forest_.histories("edge");
    // Before the first sample it is static.
    REQUIRE((histories.empty() ? 0 : histories.front().samples) == all.size());
    if (all.empty()) return;
    const std::int64_t oldest = all.front().stamp;
    const auto span = static_cast<std::size_t>(all.back().stamp - oldest);
    for (int i = 0; i < 20; ++i) {
      std::int64_t t = oldest - 1000 + static_cast<std::int64_t>(random_.index(span + 3000));
      if (i % 4 == 0) t = all[random_.index(all.size())].stamp;
      const auto [expected, found] = both(forest_, t, 1000);
      if (found) REQUIRE(transform_diff(*found, *expected, 1e-8, 1e-6) == "");
    }
  }

  void follow(bool newest_only) {
    watcher_.take({*watcher_.find("edge")}, forest_.values_since(cursors_, {newest_only}).values);
  }
  void compare_watcher(std::int64_t since) {
    const auto& all = reference_.all();
    if (all.empty() || all.back().stamp <= since) return;
    const std::int64_t from = std::max(since, all.front().stamp);
    for (int i = 0; i < 20; ++i) {
      const auto span = static_cast<std::size_t>(all.back().stamp - from);
      const std::int64_t t = from + static_cast<std::int64_t>(random_.index(span + 1));
      const auto [expected, found] = both(watcher_, t, 0);
      if (found) REQUIRE(transform_diff(*found, *expected, 1e-8, 1e-6) == "");
    }
  }
  [[nodiscard]] std::int64_t now() const { return now_; }

 private:
  std::pair<std::optional<Transform>, Result<StampedTransform>> both(const Forest& forest,
                                                                     std::int64_t t,
                                                                     std::int64_t beyond) const {
    const Query query{time_of(t), std::chrono::nanoseconds(beyond), {}};
    const auto expected = reference_.at(t, beyond);
    auto found = forest.lookup("base", "edge", query);
    INFO("at " << t << ": " << outcome(found));
    REQUIRE(found.has_value() == expected.has_value());
    return {expected, std::move(found)};
  }

  Full pose(std::int64_t stamp) {
    switch (random_.index(4)) {
      case 0:
        covariance_ = random_.covariance();
        break;
      case 1:
        covariance_ = StatedCovariance::unspecified();
        break;
      default:  // as before
        break;
    }
    // Now and then close to the sample before, as the two are interpolated in another way.
    X_ = random_.index(3) == 0 ? random_.pose() : X_ * exp(random_.twist(0.02, 0.1));
    return {stamp, {X_, covariance_}, {}};
  }
  Full value(std::int64_t stamp) {
    if (random_.index(20) == 0) mode_ = random_.index(3);
    if (mode_ == 2) return pose(stamp);
    const double reach = random_.index(5) == 0 ? 9.0 : 0.5;
    position_ += random_.uniform(-reach, reach);
    const JointState state{&joints_[mode_], {position_, random_.uniform(0, 0.1)}, periods_[mode_]};
    return {stamp, joint_value(state), state};
  }
  void revise(const Full& sample) {
    REQUIRE(forest_.revise({{"edge", sample.X, {}}}, time_of(sample.stamp), UINT64_MAX));
    reference_.replace(sample);
  }

  Random& random_;
  Reference reference_;
  Forest forest_;
  Forest watcher_;
  Handle edge_;
  std::vector<EdgeCursor> cursors_{{"edge", "base"}};
  Joint joints_[2];
  double periods_[2] = {};
  std::size_t mode_ = 0;
  double position_ = 0;
  Pose X_;
  StatedCovariance covariance_;
  std::int64_t now_ = 10'000'000;
};

}  // namespace

TEST_CASE("histories of all kinds of samples agree with lists of full samples") {
  Random random(4711);
  INFO("seed " << random.seed());
  for (const std::size_t count : {2U, 3U, 8U, 9U, 40U, 500U}) {
    Edge edge(random, count);
    for (int i = 0; i < 4000; ++i) {
      edge.step();
      if (i % 3 == 0) edge.compare();
    }
  }
}

TEST_CASE("a watcher that is sent all samples computes what the owner does") {
  Random random(4712);
  INFO("seed " << random.seed());
  Edge edge(random, 500);
  edge.step();
  edge.follow(false);
  const std::int64_t since = edge.now();
  for (int i = 0; i < 4000; ++i) {
    edge.step();
    if (random.index(3) == 0) continue;
    edge.follow(false);
    edge.compare_watcher(since);
  }
}

}  // namespace tfdude
