#include "detections.hpp"

#include "tfdude/base/id.hpp"

namespace tfdude::ros {
namespace {

std::string with_id(const std::string& pattern, const std::string& id) {
  const std::size_t place = pattern.find("{}");
  if (place == std::string::npos) return pattern;
  return pattern.substr(0, place) + id + pattern.substr(place + 2);
}

}  // namespace

DetectionImport::Sightings DetectionImport::take(const Detections& message) {
  Sightings out;
  std::map<std::string, int> count;
  for (const Detection& one : message.objects) ++count[one.id];
  for (const Detection& one : message.objects) {
    if (!settings_.ids.takes(one.id)) {
      ++counts_.left_out;
    } else if (count[one.id] > 1) {
      ++counts_.ambiguous;
      report_once("ambiguous " + quote(one.id),
                  "not taken: object " + quote(one.id) + ": a message has several of it", out);
    } else {
      take_one({message.stamp, message.frame, one.pose, one.covariance}, one.id, out);
    }
  }
  return out;
}

DetectionImport::Sightings DetectionImport::take(const TfMessage& message) {
  Sightings out;
  for (const TransformStamped& one : message) {
    const std::string object(without_slashes(one.child));
    if (!settings_.ids.takes(object)) continue;
    take_one({one.stamp, one.parent, one.pose, {}}, object, out);
  }
  return out;
}

void DetectionImport::take_one(const PoseWithCovariance& pose, const std::string& object,
                               Sightings& out) {
  const std::string name = with_id(settings_.frame, object);
  auto measured = pose_message(pose, name, settings_.prefix, settings_.variances);
  if (!measured) {
    ++counts_.invalid;
    report_once("invalid " + quote(object),
                "not taken: object " + quote(object) + ": " + measured.error().message, out);
    return;
  }
  const std::string& id = measured->b;
  if (stamps_seen_.size() >= kMostObjects && stamps_seen_.count(id) == 0) {
    ++counts_.beyond;
    report_once("beyond", "not taken: more than " + std::to_string(kMostObjects) + " objects", out);
    return;
  }
  std::optional<Time>& before = stamps_seen_[id];
  if (measured->stamp) {
    // The same sighting twice would count as two.
    if (before == measured->stamp) return stamps_.same();
    before = measured->stamp;
  } else {
    const auto report = stamps_.unstamped("object " + quote(object), "taken as seen now");
    if (report) out.reports.push_back(*report);
  }
  ++counts_.seen;
  TransformStamped value{pose.stamp, pose.frame, name, pose.pose, measured->X_AB.covariance};
  out.all.push_back({std::move(value), *std::move(measured)});
}

std::vector<std::string> DetectionImport::due(SteadyTime now) const {
  std::vector<std::string> due;
  if (!settings_.drop_after) return due;
  const std::chrono::duration<double> patience(*settings_.drop_after);
  for (const auto& [id, last] : last_seen_) {
    if (now - last >= patience) due.push_back(id);
  }
  return due;
}

void DetectionImport::report_once(const std::string& about, const std::string& text,
                                  Sightings& out) {
  constexpr std::size_t kMost = 1000;
  if (reported_.size() < kMost && reported_.insert(about).second) out.reports.push_back(text);
}

}  // namespace tfdude::ros
