#include "runtime/watched_path.hpp"

#include <algorithm>
#include <thread>
#include <vector>

#include "tfdude/base/id.hpp"

#include "base/mutex.hpp"
#include "runtime/memory_reads.hpp"
#include "tree/epoch.hpp"

namespace tfdude {
namespace {

// Whether a watch asks for more history than edges have by default.
bool keeps_more(const EdgeTiming& asked) {
  return asked.span > EdgeTiming().span || asked.count > EdgeTiming().count;
}

// How long a frame's parent may be missing before the path counts as gone: news of the parent's
// owner may come later than that of the frame's.
constexpr Milliseconds kNotConnectedFor{500};

// How long a route whose edges have no common instant waits for one while another route is shown.
constexpr Milliseconds kWaitForCommon{1000};

// How often owners are asked for earlier samples.
constexpr int kMostAskedForHistory = 10;

// Whether the edges have no instant in common.
bool lacks_common(const Result<StampedTransform>& newest) {
  return !newest && newest.error().code == Errc::kTooOld;
}

}  // namespace

WatchedPath::WatchedPath(std::string a, std::string b, WatchOptions options,
                         std::shared_ptr<Callbacks::Line> routes, MemoryReads* memory)
    : a_(std::move(a)),
      b_(std::move(b)),
      options_(std::move(options)),
      routes_(std::move(routes)),
      others_(memory),
      why_not_{Errc::kNotYet, "the " + described() + " is being asked for"} {}

WatchedPath::WatchedPath(std::vector<std::string> frames, WatchOptions options,
                         std::shared_ptr<Callbacks::Line> routes)
    : frames_(std::move(frames)),
      options_(std::move(options)),
      routes_(std::move(routes)),
      others_(nullptr),
      why_not_{Errc::kNotYet, "the " + described() + " is being asked for"} {}

WatchedPath::~WatchedPath() = default;

Result<StampedTransform> WatchedPath::lookup(const Query& query) const {
  {
    const epoch::Guard guard;
    // seq_cst: after the guard's announcement, see epoch.hpp.
    if (MemoryReads* memory = memory_.load(std::memory_order_seq_cst)) {
      return lookup_in(*memory, query);
    }
    const WatchMirror* mirror = shown_.load(std::memory_order_seq_cst);
    if (mirror != nullptr) {
      auto found = mirror->lookup(query);
      if (!wants_newest(query) || !lacks_common(found)) return found;
      if (const auto* held = held_.load(std::memory_order_seq_cst)) return *held;
    }
  }
  Lock lock(mutex_);
  if (followed_ == nullptr && in_memory()) {
    // Since a moment.
    lock.unlock();
    return lookup(query);
  }
  if (followed_ == nullptr) return tl::unexpected(why_not_);
  // Without the lock, values may just have been arriving.
  auto found = followed_->lookup(query);
  if (wants_newest(query) && lacks_common(found) && newest_) return *newest_;
  return found;
}

Result<StampedTransform> WatchedPath::lookup(std::string_view a, std::string_view b,
                                             const Query& query) const {
  {
    const epoch::Guard guard;
    const WatchMirror* mirror = shown_.load(std::memory_order_seq_cst);
    if (mirror != nullptr) return mirror->lookup(a, b, query);
  }
  const Lock lock(mutex_);
  if (followed_ == nullptr) return tl::unexpected(why_not_);
  return followed_->lookup(a, b, query);
}

std::string WatchedPath::described() const {
  if (frames_.empty()) return "path from " + quote(a_) + " to " + quote(b_);
  return "group of " + std::to_string(frames_.size()) + " edges, the first of which is " +
         quote(frames_.front());
}

bool WatchedPath::has_data(const Query& query) const {
  const epoch::Guard guard;
  if (MemoryReads* memory = memory_.load(std::memory_order_seq_cst)) {
    return memory->lookup_kept(a_, b_, query).has_value();
  }
  const WatchMirror* mirror = shown_.load(std::memory_order_seq_cst);
  return mirror != nullptr && mirror->lookup(query).has_value();
}

std::vector<Time> WatchedPath::stamps(std::string_view id, Time after) const {
  const Lock lock(mutex_);
  return followed_ != nullptr ? followed_->stamps(id, after) : std::vector<Time>();
}

Result<void> WatchedPath::health() const {
  const Lock lock(mutex_);
  if (!live()) return tl::unexpected(why_not_);
  return health_;
}

void WatchedPath::set_health(Result<void> health) {
  const Lock lock(mutex_);
  health_ = std::move(health);
}

void WatchedPath::planned() {
  const Lock lock(mutex_);
  not_connected_since_.reset();
}

bool WatchedPath::is_gone(const Error& error, Clock::time_point now) {
  if (is_unknown(error.code)) return true;
  const Lock lock(mutex_);
  if (error.code != Errc::kNotConnected) return false;
  if (!not_connected_since_) not_connected_since_ = now;
  return now - *not_connected_since_ >= kNotConnectedFor;
}

bool WatchedPath::follows(const WatchRoute& route) const {
  const Lock lock(mutex_);
  const WatchMirror* latest = this->latest();
  return latest != nullptr && latest->route().is_same(route);
}

bool WatchedPath::prepare(WatchRoute route, Clock::time_point now) {
  bool shown = false;
  {
    const Lock lock(mutex_);
    next_.reset();
    asked_for_history_ = 0;
    // The path returned to its route before the other one was shown.
    if (followed_ != nullptr && followed_->route().is_same(route)) return false;
    next_ = std::make_unique<WatchMirror>(a_, b_, std::move(route), options_.timing);
    next_since_ = now;
    if (followed_ != nullptr) next_->inherit(*followed_);
    shown = swap_if_ready(now);
  }
  tell();
  return shown;
}

bool WatchedPath::take(const PushedValues& pushed, Clock::time_point now) {
  bool is_new = false;
  bool rerouted = false;
  bool lacks = false;
  {
    const Lock lock(mutex_);
    if (followed_ != nullptr && followed_->has(pushed.group)) {
      is_new = followed_->take(pushed);
      remember_newest();
    }
    if (next_ != nullptr && next_->take(pushed)) is_new = true;
    rerouted = swap_if_ready(now);
    const WatchMirror* latest = this->latest();
    lacks = (latest != nullptr && latest->lacks()) || skipped_from();
    if (is_new) messages_.fetch_add(1, std::memory_order_relaxed);
  }
  tell();  // late samples are not new to show, but may be waited for
  if (rerouted) report_rerouted();
  return lacks;
}

void WatchedPath::remember_newest() { remember(followed_->lookup({})); }

void WatchedPath::remember(Result<StampedTransform> newest) {
  if (newest) {
    newest_ = *std::move(newest);
    hold(nullptr);
  } else if (newest.error().code == Errc::kNotYet) {
    // A history was cleared: what was before does not hold any more.
    forget_newest();
  } else if ((lacks_common(newest) || in_memory()) && newest_ && holder_ == nullptr) {
    hold(std::make_unique<const StampedTransform>(*newest_));
  }
}

void WatchedPath::forget_newest() {
  newest_.reset();
  hold(nullptr);
  latest_read_ = std::numeric_limits<std::int64_t>::min();
}

void WatchedPath::hold(std::unique_ptr<const StampedTransform> X) {
  if (X == holder_) return;
  held_.store(X.get(), std::memory_order_seq_cst);
  if (holder_ != nullptr) retired_.push_back({epoch::retire_tag(), std::move(holder_)});
  holder_ = std::move(X);
}

// Shown values must not be older than those shown before.
bool WatchedPath::swap_if_ready(Clock::time_point now) {
  if (next_ == nullptr || !next_->complete()) return false;
  if (followed_ != nullptr) {
    if (next_->is_behind(*followed_)) return false;
  }
  if (live() && now - next_since_ < kWaitForCommon) {
    const auto newest = next_->lookup({});
    if (lacks_common(newest) || is_behind_memory(newest)) return false;
  }
  const bool same = route_in_memory_ && route_in_memory_->is_same(next_->route());
  show(std::move(next_));
  memory_.store(nullptr, std::memory_order_seq_cst);
  route_in_memory_.reset();
  remember_newest();
  return std::exchange(was_shown_, true) && !same;
}

// What was read in memory may be ahead of what was told.
bool WatchedPath::is_behind_memory(const Result<StampedTransform>& told) const {
  return in_memory() && told && told->stamp &&
         nanoseconds(*told->stamp) < latest_read_.load(std::memory_order_relaxed);
}

void WatchedPath::show(std::unique_ptr<WatchMirror> mirror) {
  shown_.store(mirror.get(), std::memory_order_seq_cst);
  if (followed_ != nullptr) retired_.push_back({epoch::retire_tag(), std::move(followed_)});
  followed_ = std::move(mirror);
}

void WatchedPath::collect() {
  const Lock lock(mutex_);
  const std::uint64_t below = epoch::safe_below();
  retired_.erase(std::remove_if(retired_.begin(), retired_.end(),
                                [below](const Retired& retired) { return retired.tag < below; }),
                 retired_.end());
}

void WatchedPath::interrupt(Error why) {
  bool is_news = false;
  {
    const Lock lock(mutex_);
    const bool was_live = live();
    if (was_live) ends_.fetch_add(1, std::memory_order_relaxed);
    is_news = was_live || ended_ || why.code != why_not_.code || why.frame != why_not_.frame;
    why_not_ = std::move(why);
    next_.reset();
    memory_.store(nullptr, std::memory_order_seq_cst);
    route_in_memory_.reset();
    show(nullptr);
    forget_newest();
  }
  if (is_news) tell();
}

bool WatchedPath::up_to_date() const {
  const Lock lock(mutex_);
  if (next_ == nullptr && in_memory()) return true;
  if (next_ != nullptr || followed_ == nullptr || followed_->lacks()) return false;
  if (skipped_from()) return false;
  return asked_for_history_ >= kMostAskedForHistory || !followed_->lacks_history();
}

std::optional<Time> WatchedPath::skipped_from() const {
  const WatchMirror* latest = this->latest();
  // At a lower rate, samples are left out anyway.
  return latest == nullptr || options_.rate > 0 ? std::nullopt : latest->skipped_from();
}

void WatchedPath::on_told_from(Time from, Clock::time_point /*now*/) {
  const Lock lock(mutex_);
  if (WatchMirror* latest = this->latest()) latest->told_from(from);
}

std::optional<Time> WatchedPath::lacks_from() {
  const Lock lock(mutex_);
  WatchMirror* latest = this->latest();
  const auto skipped = skipped_from() ? latest->ask_for_skipped() : std::nullopt;
  const auto from = lacks_history();
  if (!skipped || !from) return skipped ? skipped : from;
  return std::min(*skipped, *from);
}

std::optional<Time> WatchedPath::lacks_history() {
  const WatchMirror* latest = this->latest();
  if (latest == nullptr || !latest->complete() || asked_for_history_ >= kMostAskedForHistory)
    return {};
  const auto from = latest->lacks_history();
  if (from) ++asked_for_history_;
  return from;
}

std::set<std::uint64_t> WatchedPath::groups(Clock::time_point /*now*/) {
  const Lock lock(mutex_);
  std::set<std::uint64_t> groups;
  for (const auto* mirror : {followed_.get(), next_.get()}) {
    if (mirror == nullptr) continue;
    for (const WatchRoute::Source& source : mirror->route().sources) groups.insert(source.group);
  }
  return groups;
}

// ---- rounds

std::vector<std::string> WatchedPath::frames() const {
  return frames_.empty() ? std::vector<std::string>{a_, b_} : frames_;
}

Result<WatchRoute> WatchedPath::route(const KnownStructure& known) const {
  const auto& [forest, directory, own_incarnation] = known;
  const auto period = watch_period(options_.rate);
  if (!frames_.empty()) return watch_route(forest, directory, frames_, period, own_incarnation);
  return watch_route(forest, directory, a_, b_, options_.composed, period, own_incarnation);
}

Result<void> WatchedPath::plan(const KnownStructure& known) {
  auto route = this->route(known);
  if (!route) return tl::unexpected(std::move(route.error()));
  planned_ = *std::move(route);
  // Of an edges' watch, other frames than those of the edges are unknown; composed segments cannot
  // be told apart, wherever they are. Owners keep what they keep: more must be kept here.
  planned_in_memory_ = others_ != nullptr && frames_.empty() && !options_.composed &&
                       !keeps_more(options_.timing) && others_->can_watch(planned_.parts);
  return {};
}

Watched::Plan WatchedPath::adopt(Clock::time_point now) {
  collect();
  planned();
  if (planned_in_memory_) {
    if (read_memory(now)) report_rerouted();
    return {};
  }
  Plan plan{{}, !follows(planned_)};
  for (std::size_t i = 0; i < planned_.parts.size(); ++i) {
    plan.groups.push_back({planned_.sources[i].group, planned_.parts[i]});
  }
  if (plan.is_new && prepare(std::move(planned_), now)) report_rerouted();
  return plan;
}

bool WatchedPath::on_no_plan(Error why, Clock::time_point now) {
  collect();
  const bool was_live = live();
  if (was_live && !is_gone(why, now)) {
    // Known values are still returned, with their stamps; the owner may return.
    const bool may_return = why.code == Errc::kUnreachable;
    set_health(tl::unexpected(std::move(why)));
    return may_return;
  }
  if (was_live) report(why.message);
  interrupt(std::move(why));
  return true;
}

bool WatchedPath::on_deaf(Error why) {
  set_health(tl::unexpected(std::move(why)));
  return false;
}

bool WatchedPath::on_denied(const Part& part, const Error* why) {
  Error reason = why != nullptr ? *why
                                : Error{Errc::kNotOwner, "partition " + quote(part.partition) +
                                                             " has restarted, or cannot push"};
  const bool lasts = would_deny_again(reason.code);
  // Known values are still returned, with their stamps, but nothing renews them.
  if (live()) {
    set_health(tl::unexpected(std::move(reason)));
  } else {
    interrupt(std::move(reason));
  }
  return lasts;
}

void WatchedPath::end() {
  end_waits();
  interrupt(*ended());
  if (others_ == nullptr) return;
  // Lookups that have begun before.
  const std::uint64_t tag = epoch::retire_tag();
  while (epoch::safe_below() <= tag) std::this_thread::yield();
}

void WatchedPath::report(std::string what) {
  if (routes_ == nullptr || !options_.on_route) return;
  routes_->post([path = shared_from_this(), what = std::move(what)] {
    if (!path->left_) path->options_.on_route(what);
  });
}

void WatchedPath::report_rerouted() {
  std::size_t edges = 0;
  {
    const Lock lock(mutex_);
    if (followed_ != nullptr) edges = followed_->route().edges.size();
    if (route_in_memory_) edges = route_in_memory_->edges.size();
  }
  report("the " + described() + " has a new route, over " + std::to_string(edges) + " edges");
}

}  // namespace tfdude
