#include "detections.hpp"

#include <chrono>
#include <utility>

#include <spdlog/spdlog.h>

namespace tfdude::ros {
namespace {

using Clock = cli::Worker::Clock;

// How long a sighting waits for the path to the camera at its instant.
constexpr Milliseconds kCameraPatience{500};

// How often it is checked which frames are to be removed.
constexpr std::chrono::milliseconds kDropEvery{100};

}  // namespace

Result<void> ObjectTaker::start(RosDomain& domain, const IsNeighbour& is_own) {
  Topic topic = detections_topic(settings_.topic, settings_.type);
  if (settings_.type == MessageType::kTf) topic.read_depth = tf_topic().read_depth;
  if (settings_.drop_after) worker_.repeat(kDropEvery, [this] { drop(); });
  return domain.subscribe(topic, [this, is_own](Message&& message, const Source& source) {
    if (source.bridge && is_own(*source.bridge)) return;
    worker_.post([this, taken = std::move(message), writer = source.guid] {
      if (const auto* transforms = std::get_if<TfMessage>(&taken)) {
        take(import_.take(*transforms), writer);
      } else {
        take(import_.take(std::get<Detections>(taken)), writer);
      }
    });
  });
}

void ObjectTaker::stop() {
  worker_.stop();
  const DetectionCounts& counts = import_.counts();
  spdlog::info(
      "{}: objects seen={} left out={} ambiguous={} invalid={} beyond={}; observed: accepted={} "
      "rejected by the gate={} failed={}; frames removed={}; of their stamps: {}; dropped "
      "messages={}",
      settings_.topic, counts.seen, counts.left_out, counts.ambiguous, counts.invalid,
      counts.beyond, accepted_, rejected_, failed_, dropped_, import_.stamps().summary(),
      worker_.dropped());
}

void ObjectTaker::take(const DetectionImport::Sightings& sightings, const std::string& writer) {
  for (const std::string& report : sightings.reports) {
    spdlog::warn("{}: {}", settings_.topic, report);
  }
  if (settings_.under.empty()) {
    TfMessage values;
    for (const auto& one : sightings.all) values.push_back(one.value);
    frames_.take(values, writer);
    for (const auto& one : sightings.all) import_.seen(one.measurement.b, Clock::now());
    return;
  }
  for (const auto& one : sightings.all) {
    const auto done = observe(one);
    if (done) continue;
    ++failed_;
    const Error& error = done.error();
    if (errors_.is_new(error)) spdlog::warn("{}: {}", settings_.topic, error.message);
  }
}

Result<void> ObjectTaker::observe(const DetectionImport::Sighting& one) {
  const auto& [camera, object, X_CO, stamp] = one.measurement;
  if (!X_CO.covariance.complete()) {
    return fail(Errc::kInvalidInput, "covariance: the message has none");
  }
  const auto under = id_of(settings_.under, settings_.prefix);
  if (!under) return tl::unexpected(under.error());
  Query query;
  query.at = stamp;
  const auto X_UC = node_.lookup(*under, camera, query, kCameraPatience);
  if (!X_UC) return tl::unexpected(X_UC.error());
  const RosPose place = ros_pose_of(X_UC->pose * X_CO.pose);
  frames_.place({stamp.value_or(Time()), settings_.under, one.value.child, place});
  const auto observed = node_.observe(camera, object, X_CO, stamp, settings_.options);
  if (!observed) return tl::unexpected(observed.error());
  ++(observed->accepted ? accepted_ : rejected_);
  // What is no longer where it was goes, and comes back where it is.
  if (observed->accepted) import_.seen(object, Clock::now());
  return {};
}

void ObjectTaker::drop() {
  for (const std::string& id : import_.due(Clock::now())) {
    if (!frames_.drop(id)) continue;
    import_.forget(id);
    ++dropped_;
  }
}

}  // namespace tfdude::ros
