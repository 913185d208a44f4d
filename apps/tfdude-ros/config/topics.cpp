#include "topics.hpp"

#include <algorithm>
#include <limits>
#include <map>

namespace tfdude::ros {
namespace {

constexpr double kLongest = 1e6;  // [s]

// How to read the covariances of a topic: its entry `covariance`.
Result<void> variances(const std::string& file, const YAML::Node* node, const std::string& place,
                       Variances& out) {
  if (node == nullptr) return {};
  constexpr std::array<Key, 7> kKeys = {"all_zero", "zero",      "minus_one", "none_from",
                                        "stddev",   "per_metre", "per_radian"};
  Mapping entries(file, *node, kKeys, place + ": covariance");
  std::array<std::optional<std::array<double, 6>>, 3> parts;
  entries.either("all_zero", "unspecified", "exact", out.all_zero_is_exact)
      .either("zero", "exact", "none", out.zero_is_none)
      .either("minus_one", "unspecified", "none", out.minus_one_is_none)
      .within("none_from", 1e-9, std::numeric_limits<double>::max(), out.none_from)
      .six("stddev", parts[0])
      .six("per_metre", parts[1])
      .six("per_radian", parts[2]);
  if (!entries.result()) return entries.result();
  const std::array<double, 6> zero{};
  for (const auto& part : parts) {
    const auto ok = Covariance::from_stddev(part.value_or(zero));
    if (!ok) return entries.check(ok.map([](const auto&) {})).result();
    if (part) out.stddev.emplace();
  }
  if (!out.stddev) return {};
  out.stddev =
      StddevModel{parts[0].value_or(zero), parts[1].value_or(zero), parts[2].value_or(zero)};
  return {};
}

// Whether the newest entry takes what one before takes, so that each message would count twice.
template <class Entry>
bool is_repeated(const std::vector<Entry>& all) {
  return std::any_of(all.begin(), all.end() - 1, [&](const Entry& one) {
    return without_slashes(one.topic) == without_slashes(all.back().topic) &&
           one.child == all.back().child;
  });
}
// Whether a list of patterns is a single name.
bool is_one_name(const YAML::Node* ids) {
  return ids != nullptr && ids->size() == 1 && (*ids)[0].Scalar().find('*') == std::string::npos;
}

constexpr const char* kRepeated = ": an entry before has this topic and child";

}  // namespace

Result<void> values_in(const Section& section, Settings& settings) {
  constexpr std::array<Key, 6> kKeys = {"topic", "type", "frame", "child", "edge", "covariance"};
  const auto read = [&](ValueIn& in, const YAML::Node& node, const std::string& place) {
    Mapping entries(section.file, node, kKeys, place);
    entries.require("topic")
        .topic(in.topic)
        .words("child", in.child)
        .words("edge", in.edge)
        .type(in.odometry, in.geodetic, in.frame);
    entries.check(in.odometry || !in.child.empty(), Errc::kInvalidInput,
                  ": child is missing, the frame whose pose this is");
    entries.check(in.edge.empty() || in.edge != in.child, Errc::kInvalidInput,
                  ": edge is the child itself: leave it out");
    entries.check(in.edge.empty() || in.geodetic != MessageType::kNavSatFix, Errc::kInvalidInput,
                  ": edge needs a pose, and navsat is a position only");
    entries.check(!is_repeated(settings.values_in), Errc::kInvalidInput, kRepeated);
    if (!entries.result()) return entries.result();
    return variances(section.file, entries.value("covariance"), place, in.variances);
  };
  return each(section, "values_in", settings.values_in, read);
}

Result<void> detections_in(const Section& section, Settings& settings) {
  static const std::map<std::string, MessageType> kTypes = {
      {"detection3d", MessageType::kDetection3DArray},
      {"isaac_apriltag", MessageType::kAprilTagDetectionArray},
      {"aruco", MessageType::kArucoMarkers},
      {"tf", MessageType::kTf}};
  constexpr std::array<Key, 9> kKeys = {"topic", "type", "frame",      "ids",       "except",
                                        "under", "gate", "drop_after", "covariance"};
  const auto read = [&](DetectionsIn& in, const YAML::Node& node, const std::string& place) {
    std::string type;
    Mapping entries(section.file, node, kKeys, place);
    entries.require("topic")
        .require("type")
        .topic(in.topic)
        .words("type", type)
        .words("frame", in.frame)
        .patterns("ids", in.ids.include)
        .patterns("except", in.ids.exclude)
        .words("under", in.under)
        .within("gate", 1e-9, 1, in.options.gate)
        .within("drop_after", 0.1, kLongest, in.drop_after);
    const auto known = kTypes.find(type);
    entries.check(known != kTypes.end(), Errc::kInvalidInput,
                  ": type is none of detection3d, isaac_apriltag, aruco and tf");
    if (!entries.result()) return entries.result();
    in.type = known->second;
    const bool is_tf = in.type == MessageType::kTf;
    entries.check(!is_tf || !in.ids.include.empty(), Errc::kInvalidInput,
                  ": ids is missing, the names of the transforms that are objects");
    if (in.frame.empty()) in.frame = is_tf ? "{}" : "tag_{}";
    const bool names_each = in.frame.find("{}") != std::string::npos;
    entries.check(names_each || is_one_name(entries.value("ids")), Errc::kInvalidInput,
                  ": frame needs {}, the object's id, unless ids is one name");
    if (!entries.result()) return entries.result();
    return variances(section.file, entries.value("covariance"), place, in.variances);
  };
  return each(section, "detections_in", settings.detections_in, read);
}

Result<void> poses_in(const Section& section, Settings& settings) {
  constexpr std::array<Key, 7> kKeys = {"topic", "type",       "frame",     "child",
                                        "gate",  "correlated", "covariance"};
  const auto read = [&](PoseIn& in, const YAML::Node& node, const std::string& place) {
    bool correlated = false;
    Mapping entries(section.file, node, kKeys, place);
    entries.require("topic")
        .topic(in.topic)
        .words("child", in.child)
        .within("gate", 1e-9, 1, in.options.gate)
        .flag("correlated", correlated)
        .type(in.odometry, in.geodetic, in.frame);
    entries.check(in.odometry == in.child.empty(), Errc::kInvalidInput,
                  in.odometry ? ": odometry names the child itself"
                              : ": child is missing, the frame that is measured");
    entries.check(!is_repeated(settings.poses_in), Errc::kInvalidInput, kRepeated);
    in.options.independent = !correlated;
    if (!entries.result()) return entries.result();
    return variances(section.file, entries.value("covariance"), place, in.variances);
  };
  return each(section, "poses_in", settings.poses_in, read);
}

Result<void> poses_out(const Section& section, Settings& settings) {
  constexpr std::array<Key, 5> kKeys = {"topic", "type", "frame", "child", "rate"};
  const auto read = [&](PoseOut& out, const YAML::Node& node, const std::string& place) {
    return Mapping(section.file, node, kKeys, place)
        .require("topic")
        .require("frame")
        .require("child")
        .topic(out.topic)
        .words("frame", out.frame)
        .words("child", out.child)
        .within("rate", 0, kMaxRate, out.rate)
        .type(out.odometry)
        .result();
  };
  return each(section, "poses_out", settings.poses_out, read);
}

}  // namespace tfdude::ros
