#include "values.hpp"

#include <utility>

#include <spdlog/spdlog.h>

#include "tfdude/base/id.hpp"

#include "../logic/geodetic.hpp"

namespace tfdude::ros {
namespace {

// How long a pose waits for the odometry of its instant.
constexpr Milliseconds kValuePatience{1000};

}  // namespace

Result<void> ValueTaker::start(RosDomain& domain, const IsNeighbour& is_own) {
  const Topic topic = settings_.geodetic   ? geodetic_topic(settings_.topic, *settings_.geodetic)
                      : settings_.odometry ? odometry_topic(settings_.topic)
                                           : pose_topic(settings_.topic);
  return domain.subscribe(topic, [this, is_own](Message&& message, const Source& source) {
    if (source.bridge && is_own(*source.bridge)) return;
    worker_.post([this, taken = std::move(message), writer = source.guid] {
      if (const auto* odometry = std::get_if<Odometry>(&taken)) {
        const bool named = settings_.child.empty();
        take(odometry->pose, named ? odometry->child : settings_.child, writer);
      } else if (const auto* place = std::get_if<GeoPose>(&taken)) {
        take(*place, writer);
      } else {
        take(std::get<PoseWithCovariance>(taken), settings_.child, writer);
      }
    });
  });
}

void ValueTaker::stop() {
  worker_.stop();
  spdlog::info(
      "{}: values taken={} failed={} without a place={}; of their stamps: {}; dropped messages={}",
      settings_.topic, taken_, failed_, placeless_, stamps_.summary(), worker_.dropped());
}

void ValueTaker::take(const PoseWithCovariance& message, const std::string& child,
                      const std::string& writer) {
  count(settings_.edge.empty() ? replace(transform_of(settings_, message, child), writer)
                               : determine(value_of(settings_, message, child), message.frame));
}

void ValueTaker::take(const GeoPose& message, const std::string& writer) {
  if (!has_place(message)) {
    ++placeless_;
    return;
  }
  count(settings_.edge.empty() ? replace(transform_of(settings_, message), writer)
                               : determine(value_of(settings_, message), settings_.frame));
}

void ValueTaker::count(const Result<void>& done) {
  if (done) {
    ++taken_;
    errors_.succeeded();
    return;
  }
  ++failed_;
  const Error& error = done.error();
  if (errors_.is_new(error)) spdlog::warn("{}: {}", settings_.topic, error.message);
}

Result<void> ValueTaker::replace(const Result<TransformStamped>& value, const std::string& writer) {
  if (!value) return tl::unexpected(value.error());
  frames_.take({*value}, writer);
  return {};
}

Result<void> ValueTaker::determine(Result<Measurement> value, const std::string& frame) {
  if (!value) return tl::unexpected(std::move(value.error()));
  const auto edge = id_of(settings_.edge, settings_.prefix);
  if (!edge) return tl::unexpected(edge.error());
  if (!value->X_AB.covariance.complete()) {
    return fail(Errc::kInvalidInput, "covariance: the message has none");
  }
  if (!value->stamp) {
    const auto report = stamps_.unstamped(settings_.topic, "taken at the latest common time");
    if (report) spdlog::warn("{}", *report);
  }
  Query query;
  query.at = value->stamp;
  const auto X_EB = node_.lookup(*edge, value->b, query, kValuePatience);
  if (!X_EB) return tl::unexpected(X_EB.error());
  const auto stamp = value->stamp ? value->stamp : X_EB->stamp;
  if (!stamp) {
    return fail(Errc::kInvalidInput, "neither the message has a stamp nor the frame " +
                                         quote(*edge) + " to " + quote(value->b));
  }
  const Pose X_AE = value->X_AB.pose * X_EB->pose.inverse();
  frames_.hold({*stamp, frame, settings_.edge, ros_pose_of(X_AE)});
  return node_.determine(*edge, value->a, value->b, value->X_AB, *stamp).map([](const auto&) {});
}

}  // namespace tfdude::ros
