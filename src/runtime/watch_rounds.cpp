#include "runtime/watch_rounds.hpp"

#include <algorithm>
#include <set>
#include <utility>

namespace tfdude {
namespace {

// How often paths are renewed at their owners; several times within kWatchLease.
constexpr Milliseconds kRenewEvery{1000};

// Interval of retries for what has no plan, or lacks values.
constexpr Milliseconds kRenewAgainAfter{50};

}  // namespace

void WatchRounds::end_waits() {
  Entries all;
  {
    const Lock lock(mutex_);
    waits_ended_ = true;
    all = entries_;
  }
  for (const auto& entry : all) entry->watched->end_waits();
}

void WatchRounds::end() {
  Entries all;
  {
    const Lock lock(mutex_);
    all = std::exchange(entries_, {});
  }
  for (const auto& entry : all) entry->watched->end();
}

void WatchRounds::add(std::shared_ptr<Watched> watched) {
  {
    const Lock lock(mutex_);
    // Its own lock is of a later rank.
    if (waits_ended_) watched->end_waits();
    entries_.push_back(std::make_shared<Entry>(std::move(watched)));
  }
  watches_ = true;
}

bool WatchRounds::look_again() {
  if (!watches_.load(std::memory_order_relaxed)) return false;
  replan_ = true;
  return true;
}

WatchRounds::Entries WatchRounds::entries() const {
  const Lock lock(mutex_);
  return entries_;
}

WatchRounds::Clock::time_point WatchRounds::on_pushed(const PushedValues& pushed,
                                                      Clock::time_point now) {
  auto due = kNever;
  for (const auto& entry : entries()) {
    if (!entry->watched->take(pushed, now) || entry->lacking.exchange(true)) continue;
    due = begun_.load() + kRenewAgainAfter;
  }
  return due;
}

bool WatchRounds::can_answer(const std::string& a, const std::string& b, const Query& query) const {
  const Lock lock(mutex_);
  return std::any_of(entries_.begin(), entries_.end(), [&](const std::shared_ptr<Entry>& entry) {
    return entry->watched->can_answer(a, b, query);
  });
}

Watched::Looked WatchRounds::look(Clock::time_point now) const {
  Watched::Looked all;
  for (const auto& entry : entries()) {
    const Watched::Looked one = entry->watched->look(now);
    all.is_new = all.is_new || one.is_new;
    all.again = std::min(all.again, one.again);
  }
  return all;
}

std::set<Owner> WatchRounds::owners_in_memory() const {
  std::set<Owner> owners;
  for (const auto& entry : entries()) owners.merge(entry->watched->owners_in_memory());
  return owners;
}

WatchRounds::Entries WatchRounds::drop_unused() {
  Entries used;
  Entries unused;  // destroyed without the lock
  {
    const Lock lock(mutex_);
    const auto first =
        std::stable_partition(entries_.begin(), entries_.end(),
                              [](const auto& entry) { return entry->watched.use_count() > 1; });
    unused.assign(first, entries_.end());
    entries_.erase(first, entries_.end());
    used = entries_;
  }
  // A function of the user may hold the last client. That cannot end on the thread of rounds, for
  // which it waits.
  for (auto& entry : unused) {
    if (const auto line = entry->watched->calls_on()) line->post([last = std::move(entry)] {});
  }
  return used;
}

void WatchRounds::begin(Clock::time_point now) {
  // Before it is seen what is watched: what comes later is attended to again.
  const bool replan = replan_.exchange(false);
  begun_ = now;
  const bool renews = now >= renew_at_;
  if (renews) {
    renew_at_ = now + kRenewEvery;
    ++period_;
  }
  all_ = drop_unused();
  attended_.clear();
  turns_.clear();
  turn_ = 0;
  for (const auto& entry : all_) {
    if (renews && period_ % entry->watched->periods() == 0) entry->due = true;
    const bool lacking = entry->lacking.exchange(false);
    // What has no plan stays due until something changes.
    if (lacking || replan || (renews && entry->due)) turns_.push_back(entry);
  }
}

PendingRequests* WatchRounds::step(Clock::time_point now, WatchLink& link) {
  if (asked_) answered(now);
  while (!asked_ && turn_ < turns_.size()) attend(now, link);
  if (asked_) return &*asked_;
  close_unused(now, link);
  const Entries all = std::exchange(all_, {});
  turns_.clear();
  const bool any_lacks =
      std::any_of(all.begin(), all.end(), [](const auto& entry) { return entry->lacking.load(); });
  next_ = all.empty() && open_.empty() ? kNever
          : any_lacks                  ? std::min(renew_at_, begun_.load() + kRenewAgainAfter)
                                       : renew_at_;
  return nullptr;
}

void WatchRounds::finish_turn(bool settled) {
  if (!settled) turns_[turn_]->lacking = true;
  ++turn_;
}

void WatchRounds::attend(Clock::time_point now, WatchLink& link) {
  Watched& watched = current();
  if (auto planned = link.plan(watched); !planned) {
    // An owner that is silent ends what is not renewed there meanwhile.
    turns_[turn_]->due = true;
    return finish_turn(watched.on_no_plan(std::move(planned.error()), now));
  }
  const bool due = std::exchange(turns_[turn_]->due, false);
  Watched::Plan plan = watched.adopt(now);
  groups_ = std::move(plan.groups);
  hears_all_ = true;
  asked_again_ = false;
  for (const Watched::Group& group : groups_) {
    attended_.insert(group.id);
    if (open_.contains(group.id)) continue;
    if (auto opened = link.open(group.part.partition, group.id); opened) {
      open_.insert(group.id, now);
    } else {
      hears_all_ = false;  // values come only with the answers
      if (watched.on_deaf(std::move(opened.error()))) return finish_turn(true);
    }
  }
  if (plan.is_new || due || !hears_all_ || watched.lacks(now)) {
    return ask(watched.lacks_from(), now);
  }
  watched.on_complete();
  finish_turn(true);
}

void WatchRounds::ask(std::optional<Time> from, Clock::time_point now) {
  from_ = from;
  parts_.clear();
  for (const Watched::Group& group : groups_) {
    parts_.push_back(group.part);
    std::get<WatchRequest>(parts_.back().request.body).from = from;
  }
  asked_.emplace(replies_, parts_, TimeLimit(timeout_, now));
}

void WatchRounds::answered(Clock::time_point now) {
  const std::vector<Reply> replies = asked_->take_replies();
  asked_.reset();
  Watched& watched = current();
  bool all = true;
  for (std::size_t i = 0; i < replies.size(); ++i) {
    const auto* pushed = std::get_if<PushedValues>(&replies[i].body);
    // An owner that has restarted since the plan has other groups.
    if (pushed != nullptr && pushed->group == groups_[i].id) {
      (void)watched.take(*pushed, now);
      continue;
    }
    all = false;
    if (watched.on_denied(parts_[i], std::get_if<Error>(&replies[i].body))) {
      return finish_turn(true);
    }
  }
  if (!all) return finish_turn(false);
  if (from_) watched.on_told_from(*from_, now);
  // Only the first answers show that one edge is ahead of the data of another.
  if (!std::exchange(asked_again_, true)) {
    if (const auto from = watched.lacks_earlier()) return ask(from, now);
  }
  if (!hears_all_ || watched.lacks(now)) return finish_turn(false);
  watched.on_complete();
  finish_turn(true);
}

void WatchRounds::close_unused(Clock::time_point now, WatchLink& link) {
  // Also those of a path that an owner denies: they are asked for again soon.
  std::set<std::uint64_t> used = std::exchange(attended_, {});
  for (const auto& entry : all_) used.merge(entry->watched->groups(now));
  for (const std::uint64_t group : open_.take_unused(used, now)) link.close(group);
}

}  // namespace tfdude
