#include "tfdude-ros/logic/detections.hpp"

#include <string>

#include "support/catch.hpp"
#include "tfdude-ros/logic/tf_import.hpp"

namespace tfdude::ros {
namespace {

using std::chrono::milliseconds;
using testing::ContainsSubstring;

DetectionsIn settings() {
  DetectionsIn in;
  in.topic = "/tags";
  in.frame = "tag_{}";
  in.prefix = "r1/";
  in.drop_after = 2;
  in.ids.exclude = Patterns({"9*"});
  return in;
}

Detections message(std::int64_t stamp, const std::vector<std::string>& ids) {
  Detections out{time_of(stamp), "/camera", {}};
  for (const std::string& id : ids) out.objects.push_back({id, {{0, 0, 2}, {0, 0, 0, 1}}, {}});
  return out;
}

}  // namespace

TEST_CASE("ros detections: an object has a frame that is named by its id") {
  DetectionImport import(settings());
  const auto out = import.take(message(5, {"7", "91", "8", "8", "", "x\n"}));
  REQUIRE(out.all.size() == 2);
  CHECK(out.all[0].value.parent == "/camera");
  CHECK(out.all[0].value.child == "tag_7");
  CHECK(out.all[0].measurement.a == "r1/camera");
  CHECK(out.all[0].measurement.b == "r1/tag_7");
  CHECK(out.all[0].measurement.stamp == time_of(5));
  CHECK(out.all[1].measurement.b == "r1/tag_");
  CHECK(import.counts().left_out == 1);
  CHECK(import.counts().ambiguous == 2);
  CHECK(import.counts().invalid == 1);
  CHECK(out.reports.size() == 2);
  // Zeros are no covariance, unless one is said.
  CHECK(!out.all[0].measurement.X_AB.covariance.complete());
  auto said = settings();
  said.variances.stddev = StddevModel{{1, 1, 1, 1, 1, 1}, {}, {}};
  DetectionImport other(said);
  CHECK(other.take(message(5, {"7"})).all[0].value.covariance->complete());
}

TEST_CASE("ros detections: a sighting counts once, and an unstamped one is of now") {
  DetectionImport import(settings());
  CHECK(import.take(message(5, {"7"})).all.size() == 1);
  CHECK(import.take(message(5, {"7"})).all.empty());
  CHECK(import.take(message(6, {"7"})).all.size() == 1);
  CHECK(import.stamps().counts().same == 1);
  const auto unstamped = import.take(message(0, {"7"}));
  REQUIRE(unstamped.all.size() == 1);
  CHECK(!unstamped.all[0].measurement.stamp);
  REQUIRE(unstamped.reports.size() == 1);
  CHECK_THAT(unstamped.reports[0], ContainsSubstring("no stamp"));
}

TEST_CASE("ros detections: transforms to objects are told from others by their names") {
  DetectionsIn in;
  in.frame = "{}";
  in.ids.include = Patterns({"tag36h11:*"});
  in.variances.stddev = StddevModel{{1, 1, 1, 1, 1, 1}, {}, {}};
  DetectionImport import(in);
  const auto out = import.take(
      TfMessage{{time_of(5), "camera", "/tag36h11:3", {}}, {time_of(5), "odom", "base", {}}});
  REQUIRE(out.all.size() == 1);
  CHECK(out.all[0].measurement.b == "tag36h11:3");
}

TEST_CASE("ros detections: what is not seen for a while is due, and objects are bounded") {
  DetectionImport import(settings());
  const DetectionImport::SteadyTime now{std::chrono::hours(1)};
  import.seen("r1/tag_7", now);
  import.seen("r1/tag_8", now + milliseconds(1500));
  CHECK(import.due(now + milliseconds(1999)).empty());
  CHECK(import.due(now + milliseconds(2000)) == std::vector<std::string>{"r1/tag_7"});
  import.forget("r1/tag_7");
  CHECK(import.due(now + milliseconds(2000)).empty());
  std::vector<std::string> many;
  for (std::size_t i = 0; i < kMostObjects + 5; ++i) many.push_back("m" + std::to_string(i));
  for (const std::int64_t stamp : {0, 5}) {
    DetectionImport other(settings());
    CHECK(other.take(message(stamp, many)).all.size() == kMostObjects);
    CHECK(other.take(message(stamp, {"one more"})).all.empty());
    CHECK(other.counts().beyond == 6);
  }
  // Of long names only the part that the log shows.
  const std::string name(400, 'x');
  CHECK(import.take(message(5, {name + "a", name + "a"})).reports.size() == 1);
  CHECK(import.take(message(5, {name + "b", name + "b"})).reports.empty());
  CHECK(import.take(message(5, {name + "c"})).reports.size() == 1);
  CHECK(import.take(message(5, {name + "d"})).reports.empty());
}

TEST_CASE("ros detections: a frame that observations place is static, and /tf does not move it") {
  TfImport import{{}};
  const TfImport::SteadyTime now{std::chrono::hours(1)};
  const auto nobody = [](const std::string&) { return Holding(); };
  const TransformStamped tag{time_of(5), "odom", "tag", {{1, 2, 3}, {0, 0, 0, 1}}};
  const auto placed = import.place(tag, now, nobody);
  REQUIRE(placed.edits.size() == 2);
  CHECK(placed.edits[1].kind == TfImport::Edit::Kind::kAdd);
  CHECK(!placed.edits[1].X_PC->covariance.complete());
  CHECK(placed.batches.empty());
  CHECK(!import.timing_of("tag", {}));
  CHECK(import.place(tag, now, nobody).empty());
  CHECK(import.take({{time_of(6), "camera", "tag", {}}}, "w", false, now, nobody).empty());
  CHECK(import.has_of_topic("tag"));
  CHECK(!import.has_of_topic("odom"));
  import.forget("tag");
  CHECK(import.place(tag, now, nobody).edits.size() == 1);
}

}  // namespace tfdude::ros
