#include "tfdude-ros/logic/tf_export.hpp"

#include <map>
#include <string>
#include <vector>

#include "support/catch.hpp"

namespace tfdude::ros {
namespace {

// base: world -> base -> mast -> camera; arm: base -> shoulder -> elbow -> tool
std::vector<Frame> robot() {
  return {{"world", "", "base", true},       {"base", "world", "base", true},
          {"mast", "base", "base", true},    {"camera", "mast", "base", true},
          {"shoulder", "base", "arm", true}, {"elbow", "shoulder", "arm", true},
          {"tool", "elbow", "arm", true}};
}

ExportSettings partitions(std::vector<std::string> names) {
  ExportSettings settings;
  settings.partitions = Patterns(std::move(names));
  return settings;
}

ExportSettings frames(std::vector<std::string> ids) {
  ExportSettings settings;
  settings.frames = Patterns(std::move(ids));
  return settings;
}

std::string text(const std::vector<ExportGroup>& groups) {
  std::string out;
  for (const ExportGroup& group : groups) {
    out += "[";
    for (const std::string& id : group.watched) out += id + " ";
    out += "]";
    for (const ExportEdge& edge : group.edges) out += " " + edge.ros_parent + ">" + edge.ros_child;
    out += "; ";
  }
  return out;
}

const ExportView kAll{{"base", "arm"}, {"ros"}};

StampedTransform value(double x, std::optional<Time> stamp) {
  StampedTransform X;
  X.pose = *Pose::create(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, 0, 0));
  X.stamp = stamp;
  return X;
}

Time at(std::int64_t s) { return time_of(s * 1'000'000'000); }

}  // namespace

TEST_CASE("ros export: the edges of a partition are watched together") {
  CHECK(text(plan_export(partitions({"base"}), robot(), kAll)) ==
        "[base camera mast ] world>base base>mast mast>camera; ");
  CHECK(text(plan_export(partitions({"*"}), robot(), kAll)) ==
        "[elbow shoulder tool ] base>shoulder shoulder>elbow elbow>tool; "
        "[base camera mast ] world>base base>mast mast>camera; ");
}

TEST_CASE("ros export: what is not exported is composed, also over partitions") {
  CHECK(text(plan_export(frames({"base", "tool"}), robot(), kAll)) ==
        "[elbow shoulder tool ] base>tool; ");
  CHECK(text(plan_export(frames({"world", "tool"}), robot(), kAll)) ==
        "[base elbow shoulder tool ] world>tool; ");
  // The topmost one has no edge.
  CHECK(text(plan_export(partitions({"arm"}), robot(), kAll)) ==
        "[elbow tool ] shoulder>elbow elbow>tool; ");
}

TEST_CASE("ros export: frames below those that came from ROS are connected to them") {
  auto all = robot();
  all[0].parent = "map";
  all.push_back({"map", "", "ros", true});
  all.push_back({"person", "map", "ros", true});
  all.push_back({"hat", "person", "base", true});
  CHECK(text(plan_export(frames({"base", "hat"}), all, kAll)) ==
        "[base hat world ] map>base person>hat; ");
  // Nothing that came in goes out again.
  CHECK(text(plan_export(partitions({"ros"}), all, kAll)).empty());
  CHECK(text(plan_export(frames({"person"}), all, kAll)).empty());
}

TEST_CASE("ros export: frames whose path leads over an absent partition are left out") {
  const ExportView half{{"arm"}, {}};
  CHECK(text(plan_export(partitions({"*"}), robot(), half)) ==
        "[elbow shoulder tool ] base>shoulder shoulder>elbow elbow>tool; ");
  CHECK(text(plan_export(frames({"world", "tool"}), robot(), half)).empty());
  CHECK(text(plan_export(partitions({"*"}), robot(), {})).empty());
}

TEST_CASE("ros export: with a prefix only frames that have it have a name in ROS") {
  auto settings = partitions({"*"});
  settings.prefix = "r1/";
  const std::vector<Frame> all{{"world", "", "base", true},
                               {"r1/base", "world", "base", true},
                               {"r1/arm", "r1/base", "base", true}};
  CHECK(text(plan_export(settings, all, kAll)) == "[r1/arm ] base>arm; ");
}

TEST_CASE("ros export: an edge over a joint is not sent before its first sample") {
  ExportView view = kAll;
  view.moved_by_joints = {"elbow"};
  const auto groups = plan_export(frames({"base", "shoulder", "tool"}), robot(), view);
  REQUIRE(groups.size() == 1);
  REQUIRE(groups[0].edges.size() == 2);
  CHECK(!groups[0].edges[0].moves);
  CHECK(groups[0].edges[1].moves);
  SentFrames sent;
  CHECK(sent.set_static(1, groups[0].edges, {value(1, std::nullopt), value(2, std::nullopt)}));
  CHECK(sent.all_static(at(1)).size() == 1);
  CHECK(sent.changed(groups[0].edges, {value(1, at(1)), value(2, at(1))}).size() == 2);
}

TEST_CASE("ros export: a dynamic edge is sent once for each stamp, also if time jumps back") {
  SentFrames sent;
  const std::vector<ExportEdge> edges{{"a", "b", "a", "b"}, {"b", "c", "b", "c"}};
  const auto first = sent.changed(edges, {value(1, at(1)), std::nullopt});
  REQUIRE(first.size() == 1);
  CHECK(first[0].child == "b");
  CHECK(first[0].stamp == at(1));
  CHECK(first[0].pose.xyz[0] == 1);
  CHECK(sent.changed(edges, {value(1, at(1)), value(5, std::nullopt)}).empty());
  CHECK(sent.changed(edges, {value(2, at(2)), value(5, at(2))}).size() == 2);
  CHECK(sent.changed(edges, {value(2, at(1)), value(5, at(2))}).size() == 1);
}

TEST_CASE("ros export: a change of one static edge sends those of all groups") {
  SentFrames sent;
  const std::vector<ExportEdge> one{{"a", "b", "a", "b"}};
  const std::vector<ExportEdge> two{{"a", "c", "a", "c"}};
  CHECK(sent.set_static(1, one, {value(1, std::nullopt)}));
  CHECK(sent.set_static(2, two, {value(2, std::nullopt)}));
  CHECK(!sent.set_static(1, one, {value(1, std::nullopt)}));
  CHECK(sent.set_static(1, one, {value(3, std::nullopt)}));
  const auto all = sent.all_static(at(9));
  REQUIRE(all.size() == 2);
  CHECK(all[0].stamp == at(9));
  CHECK(all[1].child == "c");
  // The edge becomes dynamic.
  CHECK(sent.set_static(1, one, {value(3, at(1))}));
  CHECK(sent.all_static(at(9)).size() == 1);
  CHECK(sent.erase_static(2));
  CHECK(!sent.erase_static(1));
}

TEST_CASE("ros export: samples that arrive together are all sent, in order") {
  SentFrames sent;
  const std::vector<ExportEdge> edges{{"a", "c", "a", "c", false, {"c", "b"}}};
  const std::map<std::string, std::vector<Time>> all{{"b", {at(2), at(4)}},
                                                     {"c", {at(1), at(2), at(3), at(5)}}};
  const auto stamps = [&](const std::string& id, Time after) {
    std::vector<Time> later;
    for (const Time one : all.at(id)) {
      if (one > after) later.push_back(one);
    }
    return later;
  };
  const auto lookup = [](const ExportEdge&, Time instant) -> Result<StampedTransform> {
    if (instant == at(3)) return fail(Errc::kTooOld, "dropped meanwhile");
    return value(7, instant);
  };
  // What was before the first message is not sent.
  CHECK(sent.between(edges, {value(1, at(1))}, stamps, lookup).empty());
  CHECK(sent.changed(edges, {value(1, at(1))}).size() == 1);
  const auto between = sent.between(edges, {value(1, at(5))}, stamps, lookup);
  REQUIRE(between.size() == 2);
  CHECK(between[0].stamp == at(2));
  CHECK(between[1].stamp == at(4));
  CHECK(between[0].child == "c");
  CHECK(sent.changed(edges, {value(1, at(5))}).size() == 1);
  CHECK(sent.between(edges, {value(1, at(5))}, stamps, lookup).empty());
}

}  // namespace tfdude::ros
