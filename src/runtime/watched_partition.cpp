#include "runtime/watched_partition.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "tfdude/base/id.hpp"

#include "partition/routing.hpp"

namespace tfdude {
namespace {

constexpr std::uint32_t kGone = UINT32_MAX;

// Edges that were written within this time of the newest sample are those that are streamed.
constexpr std::chrono::seconds kStreamed{1};

// Gives each value of an edge the correlation that is said of it with the last one.
void spread_correlations(std::vector<PushedValue>& entries) {
  std::map<std::uint32_t, const Correlation*> last;
  for (auto entry = entries.rbegin(); entry != entries.rend(); ++entry) {
    if (is_of_sample(*entry)) continue;
    const auto [known, is_last] = last.emplace(entry->index, &entry->correlation);
    if (!is_last) entry->correlation = *known->second;
  }
}

// For each frame of `from` its index in `to`, if it has the same parent there.
std::vector<std::uint32_t> places(const std::vector<WatchedFrame>& from,
                                  const std::vector<WatchedFrame>& to) {
  std::vector<std::uint32_t> indices;
  for (const WatchedFrame& frame : from) {
    const auto found =
        std::lower_bound(to.begin(), to.end(), frame,
                         [](const WatchedFrame& a, const WatchedFrame& b) { return a.id < b.id; });
    const bool stays = found != to.end() && *found == frame;
    indices.push_back(stays ? static_cast<std::uint32_t>(found - to.begin()) : kGone);
  }
  return indices;
}

}  // namespace

WatchedPartition::WatchedPartition(std::string name, double rate, Listener listener,
                                   std::shared_ptr<Callbacks::Line> line)
    : name_(std::move(name)),
      period_(watch_period(rate)),
      listener_(std::make_shared<const Listener>(std::move(listener))),
      line_(std::move(line)) {}

// ---- rounds

Result<void> WatchedPartition::plan(const KnownStructure& known) {
  const auto owner = known.directory.owner(name_);
  if (!owner) return fail_without_partition(name_);
  if (auto ready = route_to(known.directory, *owner, {}); !ready) {
    return tl::unexpected(std::move(ready.error()));
  }
  // Until all of a new process has come, its predecessor's frames are in force.
  if (*owner != kHeldHere && !known.directory.is_of_live_process(*owner)) {
    return fail_about_partition(
        Errc::kUnreachable, "partition " + quote(name_) + " has restarted, and tells its frames",
        name_);
  }
  const auto serving = known.directory.serving(name_);
  planned_ = {*owner, {}, {}, 0};
  planned_.incarnation = *owner == kHeldHere ? known.own_incarnation
                         : serving           ? serving->incarnation
                                             : 0;
  for (FrameInfo& frame : known.forest.frames()) {
    if (frame.owner != *owner) continue;
    planned_.frames.push_back({std::move(frame.id), std::move(frame.parent)});
  }
  return {};
}

std::vector<Watched::Group> WatchedPartition::group() {
  std::sort(planned_.frames.begin(), planned_.frames.end(),
            [](const WatchedFrame& a, const WatchedFrame& b) { return a.id < b.id; });
  std::vector<Watched::Group> groups;
  for (std::uint32_t i = 0; i < planned_.frames.size(); ++i) {
    const WatchedFrame& frame = planned_.frames[i];
    if (frame.parent.empty()) continue;
    if (groups.empty() || planned_.groups.back().frames.size() == most_) {
      WatchRequest request;
      request.period = period_;
      request.of_samples = true;
      planned_.groups.push_back({});
      groups.push_back({0, {planned_.owner, name_, Request{0, frame.id, request}}});
    }
    planned_.groups.back().frames.push_back(i);
    auto& request = std::get<WatchRequest>(groups.back().part.request.body);
    request.segments.push_back({frame.parent, frame.id});
  }
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const auto& request = std::get<WatchRequest>(groups[i].part.request.body);
    groups[i].id = planned_.groups[i].id = watch_group(name_, planned_.incarnation, request);
  }
  return groups;
}

Watched::Plan WatchedPartition::adopt(Clock::time_point /*now*/) {
  Plan plan{group(), false};
  plan.is_new = take_over();
  return plan;
}

bool WatchedPartition::on_no_plan(Error why, Clock::time_point /*now*/) {
  {
    const Lock lock(mutex_);
    denied_ = false;  // it may return as another process
    if (why.code == Errc::kUnknownPartition) forget_all();
  }
  became_unreachable(std::move(why.message));
  return true;
}

// The partition was forgotten. If it returns, it is new.
void WatchedPartition::forget_all() {
  if (incarnation_ == 0) return;
  incarnation_ = 0;
  groups_.clear();
  known_.clear();
  frames_.clear();
  frames_due_ = false;
  post({name_, FramesNews()});
}

void WatchedPartition::became_unreachable(std::string why) {
  const Lock lock(mutex_);
  if (std::exchange(reachable_, false)) post({name_, ReachNews{false, std::move(why)}});
}

void WatchedPartition::deny(std::string why) {
  {
    const Lock lock(mutex_);
    denied_ = true;
  }
  became_unreachable(std::move(why));
}

// Another of its groups may still be denied when one is answered.
void WatchedPartition::on_complete() {
  const Lock lock(mutex_);
  if (std::exchange(denied_, false)) became_reachable();
}

void WatchedPartition::became_reachable() {
  if (!std::exchange(reachable_, true)) post({name_, ReachNews{true, {}}});
}

bool WatchedPartition::on_deaf(Error why) {
  deny(std::move(why.message));
  return true;
}

bool WatchedPartition::on_denied(const Part& /*part*/, const Error* why) {
  if (why == nullptr) return false;
  // More edges are correlated with others than an answer can have.
  if (why->code == Errc::kInvalidInput && most_ > kMaxCorrelated) most_ = kMaxCorrelated;
  const bool lasts = would_deny_again(why->code);
  if (lasts) deny(why->message);
  return lasts;
}

// ---- news

void WatchedPartition::post(PartitionNews news, std::size_t count) {
  if (!*listener_) return;
  *waiting_ += count;
  line_->post([listener = listener_, waiting = waiting_, count, news = std::move(news)] {
    *waiting -= count;
    (*listener)(news);
  });
}

void WatchedPartition::post_frames() {
  frames_due_ = is_too_much(frames_.size());
  if (!frames_due_) post({name_, FramesNews{frames_, incarnation_}}, frames_.size());
}

bool WatchedPartition::take_over() {
  const Lock lock(mutex_);
  if (!denied_) became_reachable();
  const auto is_known = [&](const PlannedGroup& group) TFDUDE_REQUIRES(mutex_) {
    return std::any_of(groups_.begin(), groups_.end(),
                       [&](const Group& one) { return one.id == group.id && !one.outdated; });
  };
  const bool begins = planned_.incarnation != incarnation_;
  const bool same_groups = std::all_of(planned_.groups.begin(), planned_.groups.end(), is_known);
  if (!begins && same_groups && planned_.frames == frames_) {
    if (frames_due_) post_frames();
    return false;
  }
  if (begins) {
    groups_.clear();
    missing_ = {};
  }
  const bool new_frames = begins || planned_.frames != frames_;
  carry_over();
  incarnation_ = planned_.incarnation;
  answered_.reset();
  misses_recent();
  if (new_frames || frames_due_) post_frames();
  return true;
}

void WatchedPartition::carry_over() {
  std::vector<Known> known(planned_.frames.size());
  if (planned_.incarnation == incarnation_) {
    const std::vector<std::uint32_t> indices = places(frames_, planned_.frames);
    for (std::size_t i = 0; i < indices.size(); ++i) {
      if (indices[i] != kGone) known[indices[i]] = std::move(known_[i]);
    }
    for (Group& group : groups_) {
      group.outdated = true;
      for (std::uint32_t& frame : group.frames) {
        frame = frame == kGone ? kGone : indices[frame];
      }
    }
  }
  known_ = std::move(known);
  frames_ = std::move(planned_.frames);
  for (const PlannedGroup& group : planned_.groups) {
    const auto before = std::find_if(groups_.begin(), groups_.end(),
                                     [&](const Group& one) { return one.id == group.id; });
    Group fresh{group, ReceivedGroup(group.frames.size()), false};
    if (before != groups_.end()) {
      *before = std::move(fresh);
    } else {
      groups_.push_back(std::move(fresh));
    }
  }
}

bool WatchedPartition::is_news(const PushedValue& entry, Known& known, const Message& message,
                               bool is_late) const {
  const bool repeats = entry.stamp == known.newest && entry.cleared == known.cleared &&
                       entry.unsampled == known.unsampled && same(entry.X, known.X) &&
                       entry.correlation == known.correlation;
  const bool is_old = message.commit <= known.commit;
  if (repeats) {
    known.commit = std::max(known.commit, message.commit);
    return false;
  }
  // Of one commit, a part may be missing.
  if (!entry.stamp && !entry.cleared && (!message.follows_on || is_old)) return false;
  if (entry.cleared && is_old) return false;
  if (!is_late) return !is_old || entry.stamp != known.newest;
  if (message.reply ? !missing_.from() : period_.count() != 0) return false;
  return known.told.is_news(entry, message.commit, message.reply);
}

bool WatchedPartition::is_pushed_twice() const {
  return std::any_of(groups_.begin(), groups_.end(),
                     [](const Group& group) { return group.outdated; });
}

void WatchedPartition::forget_told() {
  if (is_pushed_twice()) return;
  std::optional<Time> again = missing_.from();
  if (again && asked_from_) again = std::min(*again, *asked_from_);
  for (Known& known : known_) known.told.keep_from(again);
}

void WatchedPartition::misses(Time from) {
  missing_.add(from);
  for (Known& known : known_) {
    if (!known.newest) continue;
    known.told.add(*known.newest, known.commit, known.X, known.correlation);
  }
}

void WatchedPartition::misses_recent() {
  if (missing_.since_asked()) return;
  if (const auto from = recent()) misses(*from);
}

void WatchedPartition::note_skipped(const Group& group, const PushedValues& answer) {
  std::optional<Time> skipped;
  for (const PushedValue* first : first_samples(answer, group.frames.size())) {
    if (group.frames[first->index] == kGone) continue;
    const Known& known = known_[group.frames[first->index]];
    const bool has_samples = known.newest && first->history == known.history;
    if (known.history == 0 || (has_samples && *first->stamp <= *known.newest)) continue;
    const Time from =
        has_samples ? *known.newest : std::max<Time>(Time(), *first->stamp - kStreamed);
    skipped = std::min(skipped.value_or(from), from);
  }
  if (skipped) misses(*skipped);
}

void WatchedPartition::on_told_from(Time from, Clock::time_point now) {
  const Lock lock(mutex_);
  missing_.told(from);
  if (missing_.from() || lacks_any()) return;
  if (settles(now)) misses_recent();
  forget_told();
}

void WatchedPartition::admit(const Group& group, PushedValue& entry, const Message& message,
                             std::vector<WatchedValue>& values) {
  if (entry.index >= group.frames.size()) return;
  const std::uint32_t frame = group.frames[entry.index];
  if (frame == kGone) return;
  Known& known = known_[frame];
  const bool begins = entry.history > known.history;
  if (entry.history < known.history || (begins && !entry.process_noise)) return;
  const bool goes_on = begins && entry.continues == known.history;
  // Another group, or a reply, has told the edge's value as of a later commit.
  const bool is_old = !begins && message.commit <= known.commit;
  const bool of_sample = is_of_sample(entry);
  if (is_old && !of_sample) entry.correlation = known.said;
  const bool late = !begins && entry.stamp && known.newest && *entry.stamp < *known.newest;
  if (!begins && !is_news(entry, known, message, late)) return;
  if (!of_sample) {
    if (!late || known.correlation == known.said) known.correlation = entry.correlation;
    known.said = entry.correlation;
  } else if (!late) {
    known.correlation = entry.correlation;
  }
  if (begins || entry.cleared) known.told.clear();
  if (!begins && entry.stamp && known.newest && *entry.stamp <= *known.newest) {
    known.told.corrected(message.commit);
  }
  const bool settling = !answered_ && period_.count() == 0;
  if (entry.stamp && (missing_.from() || settling || is_pushed_twice())) {
    known.told.add(*entry.stamp, message.commit, entry.X, entry.correlation);
  }
  if (!late) {
    known.history = entry.history;
    known.commit = std::max(known.commit, message.commit);
    known.newest = entry.stamp;
    known.X = entry.X;
    known.cleared = entry.cleared;
    known.unsampled = entry.unsampled;
  }
  values.push_back({frame,
                    entry.stamp,
                    entry.X,
                    std::move(entry.correlation),
                    {},
                    entry.cleared,
                    entry.unsampled});
  if (!begins) return;
  values.back().begins = entry.process_noise;
  if (goes_on) values.back().kept_before = entry.kept_before;
  values.back().drifts = entry.drifts;
}

bool WatchedPartition::take(const PushedValues& pushed, Clock::time_point now) {
  const Lock lock(mutex_);
  const auto group = std::find_if(groups_.begin(), groups_.end(),
                                  [&](const Group& one) { return one.id == pushed.group; });
  if (group == groups_.end()) return false;
  auto whole = group->received.whole(pushed);
  if (!whole) return false;
  if (frames_due_) post_frames();
  if (frames_due_ || is_too_much(whole->entries.size())) {
    group->received.skip(*whole);
    misses_recent();
    return true;
  }
  const auto [is_old, follows_on] = group->received.place(*whole);
  const Message message{is_answer(*whole), follows_on, whole->commit};
  if (!message.follows_on) {
    misses_recent();
    // Of edges that had no samples, all may be missing.
    if (!missing_.from() && group->received.answered()) misses(Time());
  }
  if (whole->after == 0 && !is_old && period_.count() == 0) note_skipped(*group, *whole);
  if (correlated_entries(*whole) > 0) spread_correlations(whole->entries);
  ValuesNews news{whole->commit, {}};
  news.values.reserve(whole->entries.size());
  for (PushedValue& entry : whole->entries) admit(*group, entry, message, news.values);
  const std::size_t count = news.values.size();
  if (count > 0) post({name_, std::move(news)}, count);
  if (lacks_any() || missing_.since_asked()) return true;
  if (settles(now)) misses_recent();
  return false;
}

bool WatchedPartition::lacks_any() const {
  return std::any_of(groups_.begin(), groups_.end(),
                     [](const Group& group) { return !group.outdated && group.received.lacks(); });
}

bool WatchedPartition::settles(Clock::time_point now) const {
  return period_.count() == 0 && (!answered_ || now - *answered_ < kSettle);
}

bool WatchedPartition::lacks(Clock::time_point now) const {
  const Lock lock(mutex_);
  return lacks_any() || missing_.from() || frames_due_ || settles(now);
}

// The oldest of the newest samples of the edges that are streamed now.
std::optional<Time> WatchedPartition::recent() const {
  std::optional<Time> newest;
  for (const Known& known : known_) {
    if (known.newest && (!newest || *known.newest > *newest)) newest = known.newest;
  }
  std::optional<Time> oldest = newest;
  for (const Known& known : known_) {
    if (known.newest && *known.newest > *newest - kStreamed) {
      oldest = std::min(*oldest, *known.newest);
    }
  }
  return oldest;
}

std::optional<Time> WatchedPartition::lacks_from() {
  const Lock lock(mutex_);
  return asked_from_ = missing_.ask();
}

std::set<std::uint64_t> WatchedPartition::groups(Clock::time_point now) {
  const Lock lock(mutex_);
  const bool answered = std::all_of(groups_.begin(), groups_.end(), [](const Group& group) {
    return group.outdated || group.received.answered();
  });
  if (answered && !answered_) answered_ = now;
  if (answered && now - *answered_ >= kKeepBefore) {
    groups_.erase(std::remove_if(groups_.begin(), groups_.end(),
                                 [](const Group& group) { return group.outdated; }),
                  groups_.end());
    forget_told();
  }
  std::set<std::uint64_t> groups;
  for (const Group& group : groups_) groups.insert(group.id);
  return groups;
}

}  // namespace tfdude
