#include "client/watches.hpp"

#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

// How often owners are told that they are watched still; several times within kWatchLease.
constexpr Milliseconds kRenewEvery{1000};

// A path that could not be followed is tried again after this.
constexpr Milliseconds kRetryAfter{50};

}  // namespace

WatchedPath::WatchedPath(std::string a, std::string b, WatchOptions options)
    : a_(std::move(a)),
      b_(std::move(b)),
      options_(std::move(options)),
      why_not_{Errc::kNotYet,
               "the path from " + quote(a_) + " to " + quote(b_) + " is being asked for"} {
  EdgeTiming timing = options_.timing;
  timing.restart_after = 0;  // it is the owner who judges a clock
  (void)mirror_.set_default_timing(timing);
}

Result<StampedTransform> WatchedPath::lookup(const Query& query) const {
  if (live_.load(std::memory_order_acquire)) {
    auto found = mirror_.lookup(a_, b_, query);
    if (found || live_.load(std::memory_order_acquire)) return found;
  }
  const std::lock_guard lock(mutex_);
  return tl::unexpected(why_not_);
}

bool WatchedPath::follows(const Route& route) const {
  const auto same_edge = [](const FrameInfo& a, const FrameInfo& b) {
    return a.id == b.id && a.parent == b.parent;
  };
  const auto same_source = [](const Source& a, const Source& b) {
    return a.group == b.group && a.incarnation == b.incarnation;
  };
  return live_.load(std::memory_order_relaxed) && route.edges.size() == route_.edges.size() &&
         route.sources.size() == route_.sources.size() &&
         std::equal(route.edges.begin(), route.edges.end(), route_.edges.begin(), same_edge) &&
         std::equal(route.sources.begin(), route.sources.end(), route_.sources.begin(),
                    same_source);
}

void WatchedPath::interrupt(Error why) {
  const std::lock_guard lock(mutex_);
  why_not_ = std::move(why);
  live_.store(false, std::memory_order_release);
}

void WatchedPath::set_health(Result<void> health) {
  const std::lock_guard lock(mutex_);
  health_ = std::move(health);
}

Result<void> WatchedPath::health() const {
  const std::lock_guard lock(mutex_);
  if (!live()) return tl::unexpected(why_not_);
  return health_;
}

void WatchedPath::follow(const Route& route, const std::vector<State>& values) {
  {
    const std::lock_guard lock(mutex_);
    rebuild(route);
    route_ = route;
    for (std::size_t i = 0; i < values.size(); ++i) write(route_.sources[i], values[i]);
    live_.store(true, std::memory_order_release);
  }
  changed_.notify_all();
}

// Frames that hang elsewhere now are made anew, as their past is that of another edge.
void WatchedPath::rebuild(const Route& route) {
  const auto parent_of = [&](const std::string& id) -> const std::string* {
    const auto edge = std::find_if(route.edges.begin(), route.edges.end(),
                                   [&](const FrameInfo& one) { return one.id == id; });
    return edge != route.edges.end() ? &edge->parent : nullptr;
  };
  for (const FrameInfo& frame : mirror_.frames()) {
    const std::string* parent = parent_of(frame.id);
    if (parent != nullptr && *parent == frame.parent) continue;
    (void)mirror_.release(frame.id);
    ties_.erase(frame.id);
  }
  constexpr auto kAllow = Forest::MissingParent::kAllow;
  for (const FrameInfo& edge : route.edges) {
    if (!mirror_.exists(edge.id)) (void)mirror_.add(edge.id, edge.parent, Transform(), kAllow);
  }
  for (const FrameInfo& edge : route.edges) {
    if (!mirror_.exists(edge.parent)) (void)mirror_.add(edge.parent, "", Transform());
  }
  if (route.edges.empty() && !mirror_.exists(a_)) (void)mirror_.add(a_, "", Transform());
}

void WatchedPath::apply(const State& state) {
  {
    const std::lock_guard lock(mutex_);
    const auto source = std::find_if(route_.sources.begin(), route_.sources.end(),
                                     [&](const Source& one) { return one.group == state.group; });
    if (source == route_.sources.end()) return;
    write(*source, state);
    messages_.fetch_add(1, std::memory_order_relaxed);
  }
  changed_.notify_all();
}

// Values of one stamp become visible at once.
void WatchedPath::write(const Source& source, const State& state) {
  auto entry = state.entries.begin();
  while (entry != state.entries.end()) {
    const auto end = std::find_if(entry, state.entries.end(),
                                  [&](const News& other) { return other.stamp != entry->stamp; });
    std::vector<EdgeUpdate> together;
    for (auto one = entry; one != end; ++one) {
      if (one->index >= source.frames.size()) return;
      together.push_back({source.frames[one->index], one->X});
    }
    for (auto one = entry; one != end; ++one) tie(source.frames[one->index], one->correlation);
    // Some may be here already, where they were told twice.
    if (!entry->stamp || !mirror_.update(together, entry->stamp)) {
      for (auto one = entry; one != end; ++one) write(source.frames[one->index], *one);
    }
    entry = end;
  }
}

// Seldom changes, and is told again with each value.
void WatchedPath::tie(const std::string& frame, const Correlation& correlation) {
  Correlation& known = ties_[frame];
  if (known == correlation) return;
  if (mirror_.correlate(frame, correlation)) known = correlation;
}

void WatchedPath::write(const std::string& frame, const News& entry) {
  const auto written = mirror_.update(frame, entry.X, entry.stamp);
  if (written || entry.stamp) return;
  // It was moving, and is not any more.
  ties_.erase(frame);
  const auto info = mirror_.info(frame);
  if (!info) return;
  (void)mirror_.release(frame);
  (void)mirror_.add(frame, info->parent, entry.X, Forest::MissingParent::kAllow);
  tie(frame, entry.correlation);
}

bool WatchedPath::wait_for_more(std::uint64_t messages,
                                std::chrono::steady_clock::time_point deadline) const {
  std::unique_lock lock(mutex_);
  return changed_.wait_until(lock, deadline, [&] { return this->messages() > messages; });
}

Result<void> WatchedPath::wait_until_live(std::chrono::steady_clock::time_point deadline) const {
  std::unique_lock lock(mutex_);
  if (changed_.wait_until(lock, deadline, [&] { return live(); })) return {};
  return tl::unexpected(why_not_);
}

Watches::Watches(Links links) : links_(std::move(links)), thread_([this] { run(); }) {}

void Watches::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_one();
  if (!thread_.joinable()) return;
  thread_.join();
  const std::lock_guard lock(mutex_);
  for (const auto& path : paths_) {
    path->interrupt({Errc::kTransport, "the client that watched the path has gone"});
  }
}

std::shared_ptr<WatchedPath> Watches::watch(const std::string& a, const std::string& b,
                                            const WatchOptions& options) {
  auto path = std::make_shared<WatchedPath>(a, b, options);
  {
    const std::lock_guard lock(mutex_);
    paths_.push_back(path);
  }
  look_again();
  return path;
}

void Watches::look_again() {
  {
    const std::lock_guard lock(mutex_);
    asked_ = true;
  }
  changed_.notify_one();
}

void Watches::on_state(const State& state) {
  std::vector<std::shared_ptr<WatchedPath>> paths;
  {
    const std::lock_guard lock(mutex_);
    paths = paths_;
  }
  for (const auto& path : paths) path->apply(state);
}

void Watches::run() {
  auto renew_at = Clock::now() + kRenewEvery;
  bool all_well = true;
  std::unique_lock lock(mutex_);
  while (true) {
    const auto wake_at = all_well ? renew_at : std::min(renew_at, Clock::now() + kRetryAfter);
    changed_.wait_until(lock, wake_at, [this] { return stopping_ || asked_; });
    if (stopping_) return;
    asked_ = false;
    // Whom nobody else has, nobody reads any more.
    paths_.erase(std::remove_if(paths_.begin(), paths_.end(),
                                [](const auto& path) { return path.use_count() == 1; }),
                 paths_.end());
    const auto paths = paths_;
    lock.unlock();
    const bool renew = Clock::now() >= renew_at;
    if (renew) renew_at = Clock::now() + kRenewEvery;
    all_well = true;
    for (const auto& path : paths) all_well = attend(*path, renew) && all_well;
    close_unused(paths);
    lock.lock();
  }
}

bool Watches::attend(WatchedPath& path, bool renew) {
  auto route = links_.plan(path);
  const bool was_live = path.live();
  if (!route) {
    // What is here goes on to be told, with its stamps; the owner may return.
    if (was_live && route.error().code == Errc::kUnreachable) {
      path.set_health(tl::unexpected(std::move(route.error())));
      return true;
    }
    if (was_live && path.options().on_route) path.options().on_route(route.error().message);
    path.interrupt(std::move(route.error()));
    return false;
  }
  path.set_health({});
  const bool same = path.follows(*route);
  if (same && !renew) return true;
  for (const WatchedPath::Source& source : route->sources) {
    if (open_.count(source.group) == 0 && links_.open(source.group)) open_.insert(source.group);
  }
  std::vector<State> values;
  for (Reply& reply : links_.ask(route->parts)) {
    if (auto* state = std::get_if<State>(&reply.body)) {
      values.push_back(std::move(*state));
    } else if (!same) {
      const auto* error = std::get_if<Error>(&reply.body);
      path.interrupt(error != nullptr ? *error : Error{Errc::kNotOwner, "an owner cannot push"});
      return false;
    }
  }
  if (same) {
    for (const State& state : values) path.apply(state);
    return true;
  }
  const bool rerouted = !path.sources().empty();
  path.follow(*route, values);
  if (rerouted && path.options().on_route) {
    path.options().on_route("the path from " + quote(path.a()) + " to " + quote(path.b()) +
                            " is followed anew, over " + std::to_string(route->edges.size()) +
                            " edges");
  }
  return true;
}

void Watches::close_unused(const std::vector<std::shared_ptr<WatchedPath>>& paths) {
  std::set<std::uint64_t> used;
  for (const auto& path : paths) {
    for (const WatchedPath::Source& source : path->sources()) used.insert(source.group);
  }
  for (auto group = open_.begin(); group != open_.end();) {
    if (used.count(*group) > 0) {
      ++group;
      continue;
    }
    links_.close(*group);
    group = open_.erase(group);
  }
}

Result<StampedTransform> PathWatch::lookup(const Query& query) const {
  return path_->lookup(query);
}

Result<StampedTransform> PathWatch::at(Time t) const {
  Query query;
  query.at = t;
  return path_->lookup(query);
}

Result<void> PathWatch::health() const { return path_->health(); }

std::uint64_t PathWatch::messages() const { return path_->messages(); }

bool PathWatch::wait_for_more(std::uint64_t messages,
                              std::chrono::steady_clock::time_point deadline) const {
  return path_->wait_for_more(messages, deadline);
}

}  // namespace tfdude
