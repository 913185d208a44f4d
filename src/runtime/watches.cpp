#include "runtime/watches.hpp"

#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

// How often watches are renewed at their owners; several times within kWatchLease.
constexpr Milliseconds kRenewEvery{1000};

// Interval of retries for a path that could not be followed, or lacks values.
constexpr Milliseconds kRetryAfter{50};

}  // namespace

Watches::Watches(Links links)
    : links_(std::move(links)),
      rounds_(kRenewEvery, kRetryAfter, [this](bool renew) { return attend_all(renew); }) {}

void Watches::stop() {
  rounds_.stop();
  notices_.stop();
  const Lock lock(mutex_);
  for (const Path& path : std::exchange(paths_, {})) {
    path->interrupt({Errc::kTransport, "the client of this watched path has ended"});
  }
}

void Watches::watch(std::shared_ptr<WatchedPath> path) {
  {
    const Lock lock(mutex_);
    paths_.push_back(std::move(path));
  }
  rounds_.ask();
}

void Watches::on_pushed(const PushedValues& pushed) {
  std::vector<Path> paths;
  {
    const Lock lock(mutex_);
    paths = paths_;
  }
  bool lacks = false;
  for (const Path& path : paths) {
    const auto taken = path->take(pushed);
    if (taken.rerouted) tell_rerouted(path);
    lacks = lacks || taken.lacks;
  }
  if (lacks) rounds_.lack();
}

bool Watches::can_answer(const std::string& a, const std::string& b, const Query& query) const {
  const Lock lock(mutex_);
  return std::any_of(paths_.begin(), paths_.end(), [&](const Path& path) {
    return path->a() == a && path->b() == b && path->has_data(query);
  });
}

bool Watches::attend_all(bool renew) {
  std::vector<Path> paths;
  std::vector<Path> gone;
  {
    const Lock lock(mutex_);
    // Paths without other holders have no readers. They are destroyed without the lock, with their
    // callbacks.
    const auto unused = std::stable_partition(
        paths_.begin(), paths_.end(), [](const Path& path) { return path.use_count() > 1; });
    gone.assign(unused, paths_.end());
    paths_.erase(unused, paths_.end());
    paths = paths_;
  }
  gone.clear();
  bool all_well = true;
  for (const Path& path : paths) all_well = attend(path, renew) && all_well;
  close_unused(paths);
  return all_well;
}

bool Watches::attend(const Path& path, bool renew) {
  path->collect();
  auto route = links_.plan(*path);
  if (!route) return cannot_be_planned(path, std::move(route.error()));
  path->planned();
  const bool well = follow(path, *route, renew);
  // An owner that has returned has to send its values first: until then old ones are shown.
  if (well) path->set_health({});
  return well;
}

bool Watches::follow(const Path& path, WatchRoute& route, bool renew) {
  const bool follows = path->follows(route);
  if (!follows && path->prepare(route)) tell_rerouted(path);
  Result<void> all_open;
  for (const WatchRoute::Source& source : route.sources) {
    if (open_.contains(source.group)) continue;
    auto opened = links_.open(source.partition, source.group);
    if (opened) {
      open_.insert(source.group, Clock::now());
    } else {
      all_open = std::move(opened);  // its values come only with the answers
    }
  }
  if (!all_open) path->set_health(all_open);
  if (follows && all_open && !renew && path->up_to_date()) return true;
  if (!ask(path, route, path->lacks_history())) return false;
  // Only the first answers show that one edge is ahead of the data of another.
  if (const auto from = path->lacks_history()) {
    if (!ask(path, route, from)) return false;
  }
  return all_open && path->up_to_date();
}

bool Watches::cannot_be_planned(const Path& path, Error why) {
  const bool was_live = path->live();
  if (was_live && !path->is_gone(why, Clock::now())) {
    // Known values are still returned, with their stamps; the owner may return.
    const bool may_return = why.code == Errc::kUnreachable;
    path->set_health(tl::unexpected(std::move(why)));
    return may_return;
  }
  if (was_live) tell(path, why.message);
  path->interrupt(std::move(why));
  return false;
}

bool Watches::ask(const Path& path, WatchRoute& route, std::optional<Time> from) {
  for (Part& part : route.parts) std::get<WatchRequest>(part.request.body).from = from;
  const std::vector<Reply> replies = links_.ask(route.parts);
  bool all = true;
  for (std::size_t i = 0; i < replies.size(); ++i) {
    const auto* pushed = std::get_if<PushedValues>(&replies[i].body);
    // An owner that has restarted since the plan has other groups.
    if (pushed != nullptr && pushed->group == route.sources[i].group) {
      if (path->take(*pushed).rerouted) tell_rerouted(path);
      continue;
    }
    all = false;
    if (path->live()) continue;
    const auto* error = std::get_if<Error>(&replies[i].body);
    path->interrupt(error != nullptr
                        ? *error
                        : Error{Errc::kNotOwner, "partition " + quote(route.sources[i].partition) +
                                                     " has restarted, or cannot push"});
  }
  return all;
}

void Watches::tell(const Path& path, std::string what) {
  if (!path->options().on_route) return;
  notices_.post([path, what = std::move(what)] { path->options().on_route(what); });
}

void Watches::tell_rerouted(const Path& path) {
  tell(path, "the " + path->described() + " has a new route, over " +
                 std::to_string(path->edge_count()) + " edges");
}

void Watches::close_unused(const std::vector<Path>& paths) {
  std::set<std::uint64_t> used;
  for (const Path& path : paths) used.merge(path->groups());
  for (const std::uint64_t group : open_.take_unused(used, Clock::now())) links_.close(group);
}

}  // namespace tfdude
