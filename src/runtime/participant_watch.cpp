#include <cmath>
#include <sstream>

#include "tfdude/base/id.hpp"

#include "runtime/participant.hpp"

// Paths that are pushed.
namespace tfdude {

Result<WatchRoute> Participant::plan_watch(const WatchedPath& path) {
  const WatchOptions& options = path.options();
  std::chrono::nanoseconds period{0};
  if (options.rate > 0) period = std::chrono::nanoseconds(std::llround(1e9 / options.rate));
  const std::lock_guard lock(structure_.mutex);
  auto plan = route_watch(structure_.forest, structure_.directory, path.a(), path.b(),
                          options.composed, period);
  if (!plan) return tl::unexpected(std::move(plan.error()));
  WatchRoute route{std::move(plan->edges), {}, std::move(plan->parts)};
  for (const Part& part : route.parts) {
    const auto& request = std::get<WatchRequest>(part.request.body);
    const auto serving = structure_.directory.serving(part.partition);
    const std::uint64_t incarnation = part.owner == kHeldHere ? member_.presence().incarnation
                                      : serving               ? serving->incarnation
                                                              : 0;
    WatchRoute::Source source{
        part.partition, incarnation, watch_group(part.partition, incarnation, request), {}};
    for (const PathEnds& segment : request.segments) source.frames.push_back(segment.to);
    route.sources.push_back(std::move(source));
  }
  return route;
}

Result<std::shared_ptr<WatchedPath>> Participant::watch(const std::string& a, const std::string& b,
                                                        const WatchOptions& options) {
  constexpr double kLeast = 1.0 / std::chrono::duration<double>(kMaxWatchPeriod).count();
  const bool every_sample = options.rate == 0;
  if (!every_sample && !(options.rate >= kLeast && options.rate <= 1e6)) {
    std::ostringstream rate;
    rate << options.rate;
    return fail(Errc::kInvalidInput,
                "the rate of a watch must be 0, or from one an hour to 1e6 Hz, not " + rate.str());
  }
  const Deadline deadline = call_deadline();
  auto known = requests_.planned(deadline, [&] { return structure_.forest.segments(a, b); });
  if (!known) return tl::unexpected(std::move(known.error()));
  Watches* watches = nullptr;
  {
    const std::lock_guard lock(pushing_mutex_);
    if (watches_ == nullptr) {
      watches_ = std::make_unique<Watches>(
          Watches::Links{[this](const WatchedPath& path) { return plan_watch(path); },
                         [this](std::vector<Part>& parts) {
                           return requests_.ask(parts, Deadline(options_.timeout));
                         },
                         [this](std::uint64_t group) { return transport_->watch(group); },
                         [this](std::uint64_t group) { transport_->unwatch(group); }});
      watching_.store(watches_.get());
    }
    watches = watches_.get();
  }
  auto path = watches->watch(a, b, options);
  if (auto live = path->wait_until_live(deadline.at()); !live) {
    return tl::unexpected(std::move(live.error()));
  }
  return path;
}

Reply Participant::answer_watch(const Request& request) {
  const auto& watch = std::get<WatchRequest>(request.body);
  Pusher* pusher = nullptr;
  {
    const std::lock_guard lock(pushing_mutex_);
    if (leaving_) {
      const std::string who = "partition " + quote(partition_name_);
      return {request.sequence, 0, Error{Errc::kNotOwner, who + " is leaving"}};
    }
    if (pusher_ == nullptr) {
      pusher_ = std::make_unique<Pusher>(
          structure_.forest,
          [this](const State& state) {
            transport_->push(state);
            if (Watches* watches = watching_.load()) watches->on_state(state);
          },
          [this](std::uint64_t group) { transport_->end_pushing(group); });
    }
    pusher = pusher_.get();
  }
  std::uint64_t incarnation = 0;
  {
    const std::lock_guard lock(structure_.mutex);
    incarnation = member_.presence().incarnation;
  }
  auto state = pusher->watch(watch_group(partition_name_, incarnation, watch), watch);
  if (!state) return {request.sequence, 0, std::move(state.error())};
  if (tied_entries(*state) > kMaxTies) {
    return {request.sequence, 0,
            Error{Errc::kInvalidInput, "partition " + quote(partition_name_) + " has more than " +
                                           std::to_string(kMaxTies) +
                                           " edges of the path that are tied to others"}};
  }
  return {request.sequence, 0, *std::move(state)};
}

void Participant::on_state(const State& state) {
  Watches* watches = watching_.load();
  if (watches == nullptr) return;
  watches->on_state(state);
  lookups_.pushed();
}

void Participant::on_watcher(std::uint64_t group) {
  const std::lock_guard lock(pushing_mutex_);
  if (pusher_ != nullptr) pusher_->tell_all(group);
}

void Participant::look_at_routes() {
  if (Watches* watches = watching_.load()) watches->look_again();
  streams_.look_again();
}

}  // namespace tfdude
