#include "poses.hpp"

#include <chrono>
#include <utility>

#include <spdlog/spdlog.h>

#include "tfdude/base/id.hpp"

#include "../logic/geodetic.hpp"

namespace tfdude::ros {
namespace {

using Clock = cli::Worker::Clock;

constexpr std::chrono::milliseconds kPatience{100};

}  // namespace

Result<std::unique_ptr<PoseSender>> PoseSender::start(Node& node, RosDomain& domain,
                                                      const PoseOut& settings) {
  auto publisher = domain.advertise(settings.odometry ? odometry_topic(settings.topic)
                                                      : pose_topic(settings.topic));
  if (!publisher) return tl::unexpected(std::move(publisher.error()));
  return std::unique_ptr<PoseSender>(new PoseSender(node, settings, *std::move(publisher)));
}

PoseSender::PoseSender(Node& node, PoseOut settings, std::unique_ptr<Publisher> publisher)
    : node_(node),
      settings_(std::move(settings)),
      publisher_(std::move(publisher)),
      thread_([this] { run(); }) {}

PoseSender::~PoseSender() {
  stopping_ = true;
  thread_.join();
}

bool PoseSender::pause() {
  std::this_thread::sleep_for(kPatience);
  return !stopping_;
}

void PoseSender::run() {
  do {
    WatchOptions options;
    options.rate = settings_.rate;
    const auto path = node_.watch(settings_.frame, settings_.child, options);
    if (path) {
      send(*path);
    } else {
      log(path.error());
    }
  } while (pause());
}

void PoseSender::send(const PathWatch& path) {
  while (!stopping_) {
    const std::uint64_t messages = path.messages();
    const auto X = path.latest();
    // An owner that is away has its frames, but they are not exported.
    const auto health = path.health();
    if (!health || !X) return log(X ? health.error() : X.error());
    publish(*X);
    while (!path.wait_for_more(messages, Clock::now() + kPatience)) {
      if (stopping_ || !path.health()) return;
    }
  }
}

void PoseSender::publish(const StampedTransform& X) {
  const Time now = node_.now().value_or(Time());
  std::optional<Message> message;
  if (settings_.odometry) {
    const auto velocity = node_.velocity(settings_.frame, settings_.child);
    if (!velocity) return log(velocity.error());
    message = message_of(settings_, X, *velocity, now);
  } else {
    message = message_of(settings_, X, now);
  }
  if (!message) {
    return log({Errc::kInvalidInput, "the covariance of " + quote(settings_.child) + " in " +
                                         quote(settings_.frame) + " is unspecified"});
  }
  errors_.has_data();
  publisher_->publish(*message);
}

void PoseSender::log(const Error& why) {
  if (errors_.is_new(why)) spdlog::warn("not sent to {}: {}", settings_.topic, why.message);
}

Result<void> PoseObserver::start(RosDomain& domain, const IsNeighbour& is_own) {
  const Topic topic = settings_.geodetic   ? geodetic_topic(settings_.topic, *settings_.geodetic)
                      : settings_.odometry ? odometry_topic(settings_.topic)
                                           : pose_topic(settings_.topic);
  return domain.subscribe(topic, [this, is_own](Message&& message, const Source& source) {
    if (source.bridge && is_own(*source.bridge)) return;
    worker_.post([this, taken = std::move(message)] {
      if (const auto* odometry = std::get_if<Odometry>(&taken)) {
        take(odometry->pose, odometry->child);
      } else if (const auto* place = std::get_if<GeoPose>(&taken)) {
        take(*place);
      } else {
        take(std::get<PoseWithCovariance>(taken), settings_.child);
      }
    });
  });
}

void PoseObserver::stop() {
  worker_.stop();
  spdlog::info(
      "{}: accepted={} rejected by the gate={} failed={} without a place={}; of their stamps: {}; "
      "dropped messages={}",
      settings_.topic, accepted_, rejected_, failed_, placeless_, stamps_.summary(),
      worker_.dropped());
}

void PoseObserver::take(const PoseWithCovariance& message, const std::string& child) {
  // The same measurement twice would count as two.
  if (last_ && is_repeat(message, *last_)) return stamps_.same();
  if (observe(measurement_of(settings_, message, child))) last_ = message;
}

void PoseObserver::take(const GeoPose& message) {
  if (!has_place(message)) {
    ++placeless_;
    return;
  }
  if (last_place_ && is_repeat(message, *last_place_)) return stamps_.same();
  if (observe(measurement_of(settings_, message))) last_place_ = message;
}

bool PoseObserver::observe(const Result<Measurement>& measured) {
  if (measured && !measured->stamp) {
    const auto report = stamps_.unstamped(settings_.topic, "observed at the latest common time");
    if (report) spdlog::warn("{}", *report);
  }
  const auto observed = measured.and_then([&](const Measurement& one) {
    return node_.observe(one.a, one.b, one.X_AB, one.stamp, settings_.options);
  });
  if (observed) {
    ++(observed->accepted ? accepted_ : rejected_);
    errors_.succeeded();
    return true;
  }
  ++failed_;
  const Error& error = observed.error();
  if (errors_.is_new(error)) spdlog::warn("{}: {}", settings_.topic, error.message);
  return false;
}

}  // namespace tfdude::ros
