#include "runtime/followed_partition.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

constexpr std::uint32_t kGone = UINT32_MAX;

// Edges that were written within this time of the newest sample are those that are streamed.
constexpr std::chrono::seconds kStreamed{1};

// Who wants every sample can wait a moment for several, which wake a thread once.
constexpr Milliseconds kGather{5};

// Gives each value of an edge the correlation that its last one has.
void spread_correlations(std::vector<PushedValue>& entries) {
  std::map<std::uint32_t, const Correlation*> last;
  for (auto entry = entries.rbegin(); entry != entries.rend(); ++entry) {
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

Result<PartitionPlan> plan_partition(const Forest& forest, const Directory& directory,
                                     const std::string& partition, std::chrono::nanoseconds period,
                                     std::uint64_t own_incarnation, std::size_t most) {
  const auto owner = directory.owner(partition);
  if (!owner) return fail(Errc::kUnknownPartition, "no partition " + quote(partition));
  auto ready = route_to(directory, *owner, {});
  if (!ready) return tl::unexpected(std::move(ready.error()));
  PartitionPlan plan;
  const auto serving = directory.serving(partition);
  plan.incarnation = *owner == kHeldHere ? own_incarnation : serving ? serving->incarnation : 0;
  for (FrameInfo& frame : forest.frames()) {
    if (frame.owner == *owner)
      plan.frames.push_back({std::move(frame.id), std::move(frame.parent)});
  }
  std::sort(plan.frames.begin(), plan.frames.end(),
            [](const WatchedFrame& a, const WatchedFrame& b) { return a.id < b.id; });
  for (std::uint32_t i = 0; i < plan.frames.size(); ++i) {
    const WatchedFrame& frame = plan.frames[i];
    if (frame.parent.empty()) continue;
    if (plan.groups.empty() || plan.groups.back().frames.size() == most) {
      WatchRequest request;
      request.period = period;
      plan.groups.push_back({0, {}, {*owner, partition, Request{0, frame.id, request}}});
    }
    PartitionPlan::Group& group = plan.groups.back();
    group.frames.push_back(i);
    std::get<WatchRequest>(group.part.request.body).segments.push_back({frame.parent, frame.id});
  }
  for (PartitionPlan::Group& group : plan.groups) {
    group.id =
        watch_group(partition, plan.incarnation, std::get<WatchRequest>(group.part.request.body));
  }
  return plan;
}

FollowedPartition::FollowedPartition(std::string name, std::chrono::nanoseconds period,
                                     Listener listener)
    : name_(std::move(name)),
      period_(period),
      listener_(std::make_shared<const Listener>(std::move(listener))),
      notices_(period.count() == 0 ? kGather : Milliseconds(0)) {}

void FollowedPartition::stop() {
  stopped_ = true;
  notices_.stop();
}

void FollowedPartition::post(PartitionNews news, std::size_t values) {
  if (!*listener_) return;
  *waiting_ += values;
  notices_.post([listener = listener_, waiting = waiting_, values, news = std::move(news)] {
    *waiting -= values;
    (*listener)(news);
  });
}

bool FollowedPartition::follow(const PartitionPlan& plan) {
  const Lock lock(mutex_);
  if (!std::exchange(reachable_, true)) post({name_, ReachNews{true, {}}});
  const auto is_known = [&](const PartitionPlan::Group& group) TFDUDE_REQUIRES(mutex_) {
    return std::any_of(groups_.begin(), groups_.end(),
                       [&](const Group& one) { return one.id == group.id && !one.outdated; });
  };
  const bool begins = plan.incarnation != incarnation_;
  const bool same_groups = std::all_of(plan.groups.begin(), plan.groups.end(), is_known);
  if (!begins && same_groups && plan.frames == frames_) return false;
  if (begins) groups_.clear();
  const bool new_frames = begins || plan.frames != frames_;
  carry_over(plan);
  incarnation_ = plan.incarnation;
  answered_.reset();
  missing_from_ = recent();
  if (new_frames) post({name_, FramesNews{plan.frames, plan.incarnation}});
  return true;
}

// Keeps what is known of edges that stay, and the groups of before.
void FollowedPartition::carry_over(const PartitionPlan& plan) {
  std::vector<Known> known(plan.frames.size());
  if (plan.incarnation == incarnation_) {
    const std::vector<std::uint32_t> indices = places(frames_, plan.frames);
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
  frames_ = plan.frames;
  for (const PartitionPlan::Group& group : plan.groups) {
    const auto before = std::find_if(groups_.begin(), groups_.end(),
                                     [&](const Group& one) { return one.id == group.id; });
    Group fresh{group.id, group.frames, {}, KnownCovariances(group.frames.size())};
    if (before != groups_.end()) {
      *before = std::move(fresh);
    } else {
      groups_.push_back(std::move(fresh));
    }
  }
}

void FollowedPartition::interrupt(const std::string& why) {
  const Lock lock(mutex_);
  if (std::exchange(reachable_, false)) post({name_, ReachNews{false, why}});
}

FollowedPartition::Message FollowedPartition::place(Group& group, const PushedValues& whole,
                                                    bool knows_all) {
  Message message;
  message.reply = whole.after == 0;
  message.commit = whole.commit;
  message.follows_on =
      message.reply || (knows_all && whole.after <= std::max(group.complete, group.replied));
  group.heard = std::max(group.heard, whole.commit);
  if (message.reply) {
    group.replied = std::max(group.replied, whole.commit);
  } else if (message.follows_on) {
    group.complete = std::max(group.complete, whole.commit);
  }
  return message;
}

void FollowedPartition::admit(const Group& group, PushedValue& entry, const Message& message,
                              std::vector<WatchedValue>& values) {
  if (entry.index >= group.frames.size()) return;
  const std::uint32_t frame = group.frames[entry.index];
  if (frame == kGone) return;
  Known& known = known_[frame];
  const bool begins = entry.history > known.history;
  if (entry.history < known.history || (begins && !entry.process_noise)) return;
  // Another group, or a reply, has told the edge's value as of a later commit.
  const bool is_old = !begins && message.commit <= known.commit;
  if (is_old) entry.correlation = known.correlation;
  bool late = false;
  if (!begins) {
    const bool repeats = entry.stamp == known.newest && entry.cleared == known.cleared &&
                         entry.unsampled == known.unsampled && same(entry.X, known.X) &&
                         entry.correlation == known.correlation;
    if (repeats) return;
    // Of one commit, a part may be missing.
    if (!entry.stamp && !entry.cleared && (!message.follows_on || is_old)) return;
    if (entry.cleared && is_old) return;
    late = entry.stamp && known.newest && *entry.stamp < *known.newest;
    const bool wanted = message.reply ? missing_from_.has_value() : period_.count() == 0;
    if (late && !wanted) return;
  }
  known.correlation = entry.correlation;
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
  if (begins) values.back().begins = entry.process_noise;
}

bool FollowedPartition::take(const PushedValues& pushed) {
  const Lock lock(mutex_);
  const auto group = std::find_if(groups_.begin(), groups_.end(),
                                  [&](const Group& one) { return one.id == pushed.group; });
  if (group == groups_.end()) return false;
  auto whole = group->pieces.add(pushed);
  if (!whole) return false;
  if (*waiting_ + whole->entries.size() > kMostWaiting && *waiting_ > 0) {
    group->heard = std::max(group->heard, whole->commit);
    if (!missing_from_) missing_from_ = recent();
    return true;
  }
  const bool knows_all = group->covariances.fill_in(whole->entries);
  const Message message = place(*group, *whole, knows_all);
  if (!message.follows_on && !missing_from_) missing_from_ = recent();
  if (correlated_entries(*whole) > 0) spread_correlations(whole->entries);
  ValuesNews news{whole->commit, {}};
  news.values.reserve(whole->entries.size());
  for (PushedValue& entry : whole->entries) admit(*group, entry, message, news.values);
  const std::size_t count = news.values.size();
  if (count > 0) post({name_, std::move(news)}, count);
  if (lacks_any()) return true;
  missing_from_.reset();
  if (settles(Clock::now())) missing_from_ = recent();
  return false;
}

bool FollowedPartition::lacks_any() const {
  return std::any_of(groups_.begin(), groups_.end(), [](const Group& group) {
    const std::uint64_t known = std::max(group.complete, group.replied);
    return !group.outdated && (group.replied == 0 || group.heard > known);
  });
}

bool FollowedPartition::settles(Clock::time_point now) const {
  return period_.count() == 0 && (!answered_ || now - *answered_ < kSettle);
}

bool FollowedPartition::lacks(Clock::time_point now) const {
  const Lock lock(mutex_);
  return lacks_any() || settles(now);
}

// The oldest of the newest samples of the edges that are streamed now.
std::optional<Time> FollowedPartition::recent() const {
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

std::optional<Time> FollowedPartition::lacks_from() const {
  const Lock lock(mutex_);
  return missing_from_;
}

std::set<std::uint64_t> FollowedPartition::groups(Clock::time_point now) {
  const Lock lock(mutex_);
  const bool answered = std::all_of(groups_.begin(), groups_.end(), [](const Group& group) {
    return group.outdated || group.replied != 0;
  });
  if (answered && !answered_) answered_ = now;
  if (answered && now - *answered_ >= kKeepBefore) {
    groups_.erase(std::remove_if(groups_.begin(), groups_.end(),
                                 [](const Group& group) { return group.outdated; }),
                  groups_.end());
  }
  std::set<std::uint64_t> groups;
  for (const Group& group : groups_) groups.insert(group.id);
  return groups;
}

}  // namespace tfdude
