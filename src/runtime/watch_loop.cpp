#include "runtime/watch_loop.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "runtime/requests.hpp"

namespace tfdude {
namespace {

// How often paths are renewed at their owners; several times within kWatchLease.
constexpr Milliseconds kRenewEvery{1000};

// Interval of retries for what has no plan, or lacks values.
constexpr Milliseconds kRetryAfter{50};

}  // namespace

WatchLoop::WatchLoop(const Context& context)
    : context_(context), rounds_(context.threads.asking, [this] { return round(); }) {}

void WatchLoop::stop() {
  rounds_.stop();
  Entries all;
  {
    const Lock lock(mutex_);
    all = std::exchange(entries_, {});
  }
  for (const auto& entry : all) entry->watched->end();
}

void WatchLoop::add(std::shared_ptr<Watched> watched) {
  {
    const Lock lock(mutex_);
    entries_.push_back(std::make_shared<Entry>(std::move(watched)));
  }
  watches_ = true;
  rounds_.ask();
}

void WatchLoop::look_again() {
  if (!watches_.load(std::memory_order_relaxed)) return;
  replan_ = true;
  rounds_.ask();
}

WatchLoop::Entries WatchLoop::entries() const {
  const Lock lock(mutex_);
  return entries_;
}

void WatchLoop::on_pushed(const PushedValues& pushed) {
  for (const auto& entry : entries()) {
    if (!entry->watched->take(pushed) || entry->lacking.exchange(true)) continue;
    rounds_.ask_by(last_round_.load() + kRetryAfter);
  }
}

bool WatchLoop::can_answer(const std::string& a, const std::string& b, const Query& query) const {
  const Lock lock(mutex_);
  return std::any_of(entries_.begin(), entries_.end(), [&](const std::shared_ptr<Entry>& entry) {
    return entry->watched->can_answer(a, b, query);
  });
}

WatchLoop::Entries WatchLoop::drop_unused() {
  Entries unused;  // destroyed without the lock, with their callbacks
  const Lock lock(mutex_);
  const auto first = std::stable_partition(entries_.begin(), entries_.end(), [](const auto& entry) {
    return entry->watched.use_count() > 1;
  });
  unused.assign(first, entries_.end());
  entries_.erase(first, entries_.end());
  return entries_;
}

WatchLoop::Clock::time_point WatchLoop::round() {
  // Before it is seen what is watched: what comes later is attended to again.
  const bool replan = replan_.exchange(false);
  const auto begin = Clock::now();
  last_round_ = begin;
  const bool renews = begin >= renew_at_;
  if (renews) {
    renew_at_ = begin + kRenewEvery;
    ++period_;
  }
  const Entries all = drop_unused();
  for (const auto& entry : all) {
    const bool renew = renews && period_ % entry->watched->periods() == 0;
    const bool lacking = entry->lacking.exchange(false);
    if (!lacking && !replan && !renew) continue;
    if (!attend(*entry->watched, renew)) entry->lacking = true;
  }
  close_unused(all);
  if (all.empty() && open_.empty()) return Loop::kNever;
  const bool any_lacks =
      std::any_of(all.begin(), all.end(), [](const auto& entry) { return entry->lacking.load(); });
  return any_lacks ? std::min(renew_at_, begin + kRetryAfter) : renew_at_;
}

bool WatchLoop::attend(Watched& watched, bool renew) {
  auto plan = watched.plan(context_);
  if (!plan) return watched.on_no_plan(std::move(plan.error()));
  bool hears_all = true;
  for (const Watched::Group& group : plan->groups) {
    if (open_.contains(group.id)) continue;
    if (auto opened = context_.transport.watch(group.part.partition, group.id); opened) {
      open_.insert(group.id, Clock::now());
    } else {
      hears_all = false;  // values come only with the answers
      if (watched.on_deaf(std::move(opened.error()))) return true;
    }
  }
  const bool must_ask = plan->is_new || renew || !hears_all || watched.lacks(Clock::now());
  if (must_ask) {
    const Answered answered = ask(watched, plan->groups, watched.lacks_from());
    if (answered != Answered::kAll) return answered == Answered::kNotUntilRenewal;
    // Only the first answers show that one edge is ahead of the data of another.
    if (const auto from = watched.lacks_earlier()) {
      if (ask(watched, plan->groups, from) != Answered::kAll) return false;
    }
    if (!hears_all || watched.lacks(Clock::now())) return false;
  }
  watched.on_complete();
  return true;
}

WatchLoop::Answered WatchLoop::ask(Watched& watched, const std::vector<Watched::Group>& groups,
                                   std::optional<Time> from) {
  std::vector<Part> parts;
  for (const Watched::Group& group : groups) {
    parts.push_back(group.part);
    std::get<WatchRequest>(parts.back().request.body).from = from;
  }
  const auto replies = context_.requests.ask(parts, Deadline(context_.options.timeout));
  bool all = true;
  for (std::size_t i = 0; i < replies.size(); ++i) {
    const auto* pushed = std::get_if<PushedValues>(&replies[i].body);
    // An owner that has restarted since the plan has other groups.
    if (pushed != nullptr && pushed->group == groups[i].id) {
      (void)watched.take(*pushed);
      continue;
    }
    all = false;
    if (watched.on_denied(parts[i], std::get_if<Error>(&replies[i].body))) {
      return Answered::kNotUntilRenewal;
    }
  }
  if (all && from) watched.on_told_from(*from);
  return all ? Answered::kAll : Answered::kPartly;
}

void WatchLoop::close_unused(const Entries& all) {
  const auto now = Clock::now();
  std::set<std::uint64_t> used;
  for (const auto& entry : all) used.merge(entry->watched->groups(now));
  for (const std::uint64_t group : open_.take_unused(used, now)) context_.transport.unwatch(group);
}

}  // namespace tfdude
