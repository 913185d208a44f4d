#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/math/ros_variances.hpp"

#include "../messages.hpp"
#include "../ros_domain.hpp"
#include "names.hpp"
#include "poses.hpp"
#include "stamps.hpp"

// Objects that cameras see, as frames. No DDS, no threads and no clock.
namespace tfdude::ros {

/// A topic of detections.
struct DetectionsIn {
  std::string topic;
  MessageType type = MessageType::kDetection3DArray;  ///< kTf: transforms whose child is the object
  std::string frame{};  ///< name of an object's frame in ROS; "{}" stands for its id
  Choice ids{};         ///< of the objects
  /// The frame in which the objects stand still: each sighting is a measurement. Empty: their
  /// frames are below that of the camera, and each sighting is a value.
  std::string under{};
  std::optional<double> drop_after{};  ///< a frame that was not seen for so long is removed [s]
  std::string prefix{};
  ObserveOptions options{};
  Variances variances{};
};

struct DetectionCounts {
  std::uint64_t seen = 0;
  std::uint64_t left_out = 0;   ///< not among the chosen ids
  std::uint64_t ambiguous = 0;  ///< several of one id in a message
  std::uint64_t invalid = 0;    ///< a name, pose or covariance that is none
  std::uint64_t beyond = 0;     ///< more than kMostObjects
};

/// A topic has at most so many frames at a time.
inline constexpr std::size_t kMostObjects = 1000;

class DetectionImport {
 public:
  using SteadyTime = std::chrono::steady_clock::time_point;

  /// An object, as a value of its own edge and as a measurement.
  struct Sighting {
    TransformStamped value;  ///< the child is its frame
    Measurement measurement;
  };
  struct Sightings {
    std::vector<Sighting> all;
    std::vector<std::string> reports;  ///< each once, for the log
  };

  explicit DetectionImport(DetectionsIn settings) : settings_(std::move(settings)) {}

  [[nodiscard]] Sightings take(const Detections& message);
  /// Transforms of cameras to objects. Others on the topic are left out.
  [[nodiscard]] Sightings take(const TfMessage& message);

  /// A frame has got a value.
  void seen(const std::string& id, SteadyTime now) { last_seen_[id] = now; }
  /// The frames that are due to be removed. Each is returned again until it is forgotten.
  [[nodiscard]] std::vector<std::string> due(SteadyTime now) const;
  void forget(const std::string& id) {
    last_seen_.erase(id);
    stamps_seen_.erase(id);
  }

  [[nodiscard]] const DetectionCounts& counts() const { return counts_; }
  [[nodiscard]] StampReports& stamps() { return stamps_; }

 private:
  void take_one(const PoseWithCovariance& pose, const std::string& object, Sightings& out);
  void report_once(const std::string& about, const std::string& text, Sightings& out);

  const DetectionsIn settings_;
  DetectionCounts counts_;
  StampReports stamps_;
  std::map<std::string, SteadyTime> last_seen_;             // by the id here
  std::map<std::string, std::optional<Time>> stamps_seen_;  // of the last sighting, by the same
  std::set<std::string> reported_;
};

}  // namespace tfdude::ros
