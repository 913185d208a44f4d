#include <algorithm>
#include <cstddef>
#include <utility>

#include "simulation/process.hpp"

// What a process stores, publishes and replies, by the library's Commits.
namespace tfdude::simulation {
namespace {

// Checkpoints that sync all, by how many commits on average.
constexpr std::size_t kCheckpointEvery = 32;

}  // namespace

void Process::when_stored(std::function<void(const Result<void>&)> then) {
  if (!commits_.stores()) return then({});
  waiting_.emplace_back(commits_.want(), std::move(then));
  look_at_commits();
}

// As a job of a Loop.
void Process::look_at_commits() {
  const auto time = std::max(commits_.next(), now());
  if (committing_ || time >= commit_at_) return;
  commit_at_ = time;
  later("commit", time - now(), [this, time] {
    if (commit_at_ != time) return;
    commit_at_ = Commits::kNever;
    commit();
  });
}

// Taken now, on the disk a moment later; a process that is killed meanwhile has stored it or not.
void Process::commit() {
  if (commits_.next() > now()) return look_at_commits();
  committing_ = true;
  const auto ready = std::make_shared<Ready>(commits_.begin(now()));
  const auto longest = static_cast<std::size_t>(world_.plan.disk.count());
  const Instant disk(commits_.stores() ? world_.random.index(longest + 1) : 0);
  later("disk", disk, [this, ready] {
    perform(*ready);
    for (auto one = waiting_.begin(); one != waiting_.end();) {
      const auto stored = commits_.outcome(one->first);
      if (!stored) {
        ++one;
        continue;
      }
      const auto then = std::move(one->second);
      one = waiting_.erase(one);
      then(*stored);
    }
    committing_ = false;
    look_at_commits();
  });
}

void Process::perform(const Ready& ready) {
  Result<void> stored;
  if (ready.refused) {
    stored = tl::unexpected(*ready.refused);
  } else if (commits_.stores()) {
    stored = setting_.disk->save(ready.rows, world_.timeline.now());
    if (world_.random.index(kCheckpointEvery) == 0) setting_.disk->checkpoint();
  }
  if (stored && ready.rows.absent) {
    for (const Absent& one : *ready.rows.absent) {
      if (one.kind != Absent::Kind::kForgotten) continue;
      auto& stored_last = world_.forgotten_by[one.partition][partition()];
      if (stored_last.first != one.since) stored_last = {one.since, world_.timeline.now()};
    }
  }
  commits_.finish(ready, stored, {}, now());
  react();
}

Ready Process::take(bool values_due) {
  Ready ready = member_.take_ready(values_due);
  if (!ready.refused) member_.partition()->add_values(ready.rows);
  return ready;
}

void Process::publish(const Ready& ready) {
  const auto said = member_.stored(ready);
  for (const Page& page : ready.pages) {
    if (!ready.refused) world_.invariants.publishes(*this, page);
    pages_[page.number] = page;
    world_.network.publish(*this, page);
  }
  announce(said);
}

void Process::take_back(const Ready& ready) { announce(member_.not_stored(ready)); }

void Process::reply(const PendingReply& pending) {
  world_.invariants.replies(*this, pending.reply);
  reply_to(process_of(pending.to), pending.reply);
}

void Process::announce(const std::optional<Presence>& presence) {
  if (!presence) return;
  presence_ = *presence;
  world_.network.publish(*this, *presence);
}

std::vector<Sample> Process::published() const {
  std::vector<Sample> all;
  if (presence_) all.emplace_back(*presence_);
  for (const auto& [number, page] : pages_) all.emplace_back(page);
  return all;
}

}  // namespace tfdude::simulation
