// Edges of ROS whose values come from other topics than /tf, or from observations.

#include <string>
#include <vector>

#include "support/catch.hpp"
#include "tfdude-ros/logic/tf_import.hpp"

namespace tfdude::ros {
namespace {

using Kind = TfImport::Edit::Kind;

Time at(double s) { return time_of(1'000'000'000 + static_cast<std::int64_t>(s * 1e9)); }

TransformStamped tf(const std::string& parent, const std::string& child, double stamp,
                    double x = 0) {
  return {at(stamp), parent, child, {{x, 0, 0}, {0, 0, 0, 1}}};
}

TransformStamped of_topic(const std::string& parent, const std::string& child, double stamp,
                          const StatedCovariance& covariance = StatedCovariance::exact()) {
  TransformStamped one = tf(parent, child, stamp, 5);
  one.covariance = covariance;
  return one;
}

struct Rig {
  explicit Rig(ImportSettings settings = {}) : import(std::move(settings)) {}

  TfImport::Changes take(const TransformStamped& one, const std::string& writer = "tf") {
    return import.take({one}, writer, false, now, nobody);
  }
  TfImport::Changes hold(const TransformStamped& one) { return import.hold(one, now, nobody); }

  TfImport import;
  TfImport::SteadyTime now{std::chrono::hours(1)};
  TfImport::WhoHolds nobody = [](const std::string&) { return Holding(); };
};

// The ids of a batch's edges, and the stamp.
std::string samples(const TfImport::Changes& changes) {
  std::string out;
  for (const auto& batch : changes.batches) {
    for (const auto& one : batch.edges) {
      out += one.id + '@' + std::to_string(nanoseconds(*batch.stamp) / 1'000'000 - 1000) + ' ';
    }
  }
  return out;
}

}  // namespace

TEST_CASE("ros values: from the first value of a topic on, /tf's of the same edge are left out") {
  Rig rig;
  CHECK(samples(rig.take(tf("odom", "base", 1))) == "base@1000 ");
  const auto first = rig.take(of_topic("odom", "base", 1.02), "ekf");
  REQUIRE(first.edits.size() == 1);
  CHECK(first.edits[0].kind == Kind::kClear);
  REQUIRE(first.batches.size() == 1);
  CHECK(first.batches[0].edges[0].X_PC.covariance.complete());
  CHECK(first.reports.empty());
  CHECK(rig.take(tf("odom", "base", 1.02)).empty());
  CHECK(rig.take(tf("odom", "base", 1.04)).empty());
  CHECK(samples(rig.take(of_topic("odom", "base", 1.04), "ekf")) == "base@1040 ");
  CHECK(rig.import.counts().joined == 2);
}

TEST_CASE("ros values: a topic says the parent, and two topics of one edge are reported") {
  Rig rig;
  (void)rig.take(tf("map", "base", 1));
  const auto moved = rig.take(of_topic("odom", "base", 1), "ekf");
  REQUIRE(moved.edits.size() == 2);
  CHECK(moved.edits[1].kind == Kind::kMove);
  CHECK(rig.take(tf("map", "base", 2)).empty());
  CHECK(rig.take(of_topic("odom", "base", 2), "wheels").reports.size() == 1);
}

TEST_CASE("ros values: an edge that drifts begins exactly, unless something is said of it") {
  ImportSettings settings;
  settings.prefix = "r1/";
  settings.drifts["base"] = *Covariance::from_stddev({0.1, 0.1, 0, 0, 0, 0.05});
  Rig rig(settings);
  const auto added = rig.take(tf("odom", "base", 1));
  REQUIRE(added.batches.size() == 1);
  CHECK(added.batches[0].edges[0].X_PC.covariance == StatedCovariance::exact());
  const auto said =
      rig.take(of_topic("odom", "base", 2, *Covariance::from_stddev({1, 1, 1, 1, 1, 1})), "ekf");
  CHECK(said.batches[0].edges[0].X_PC.covariance != StatedCovariance::exact());
  EdgeTiming usual;
  usual.count = 77;
  const auto timing = rig.import.timing_of("r1/base", usual);
  REQUIRE(timing);
  CHECK(timing->drifts);
  CHECK(timing->moving);
  CHECK(timing->count == 77);
  CHECK(timing->process_noise.upper() == settings.drifts["base"].upper());
  CHECK(!rig.import.timing_of("base", usual));
  CHECK(!rig.import.timing_of("r1/odom", usual));
}

TEST_CASE("ros values: a repeated sample of an edge that drifts is the same one") {
  ImportSettings settings;
  settings.drifts["base"] = *Covariance::from_stddev({1, 1, 1, 1, 1, 1});
  Rig rig(settings);
  CHECK(samples(rig.take(tf("odom", "base", 1, 2))) == "base@1000 ");
  CHECK(rig.take(tf("odom", "base", 1, 2)).empty());
  CHECK(rig.import.stamps().counts().same == 1);
  // Another value is for the partition to reject.
  CHECK(samples(rig.take(tf("odom", "base", 1, 3))) == "base@1000 ");
}

TEST_CASE("ros values: a held edge has the samples of the edges below it, and of /tf") {
  Rig rig;
  (void)rig.take(tf("odom", "base", 1));
  (void)rig.take(tf("map", "odom", 2, 9));
  const auto held = rig.hold(tf("map", "odom", 1, 3));
  REQUIRE(held.edits.size() == 1);
  CHECK(held.edits[0].kind == Kind::kMove);
  CHECK(!held.edits[0].X_PC->covariance.complete());
  CHECK(samples(held) == "odom@1000 ");
  CHECK(held.batches[0].edges[0].X_PC.pose.translation().x() == 3);
  CHECK(rig.import.timing_of("odom", {})->drifts);
  CHECK(rig.import.timing_of("odom", {})->process_noise.upper() == Covariance().upper());
  // Once is enough.
  CHECK(rig.hold(tf("map", "odom", 1.5, 4)).empty());
  CHECK(samples(rig.take(tf("odom", "base", 2))) == "base@2000 odom@2000 ");
  // What /tf says of its value does not count.
  const auto joined = rig.take(tf("map", "odom", 3, 9));
  CHECK(samples(joined) == "odom@3000 ");
  CHECK(joined.batches[0].edges[0].X_PC.pose.translation().x() == 3);
  CHECK(samples(rig.take(tf("odom", "base", 2.5))) == "base@2500 ");
  CHECK(samples(rig.take(tf("odom", "base", 3.5))) == "base@3500 odom@3500 ");
}

TEST_CASE("ros values: a jump back of time ends what was found out about a held edge") {
  Rig rig;
  (void)rig.take(tf("odom", "base", 10));
  (void)rig.hold(tf("map", "odom", 10));
  const auto jumped = rig.take(tf("odom", "base", 1));
  REQUIRE(jumped.edits.size() == 2);
  CHECK(jumped.edits[0].kind == Kind::kClear);
  CHECK(jumped.edits[1].kind == Kind::kMove);
  CHECK(jumped.edits[1].id == "odom");
  CHECK(!jumped.edits[1].X_PC->covariance.complete());
  CHECK(samples(jumped) == "base@1000 odom@1000 ");
}

}  // namespace tfdude::ros
