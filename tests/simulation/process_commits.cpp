#include <cstddef>
#include <utility>

#include "simulation/process.hpp"

// What a process stores, publishes and replies, in this order, as CommitLoop does.
namespace tfdude::simulation {
namespace {

constexpr Instant kRetryStoring = milliseconds(200);
// Checkpoints that sync all, by how many commits on average.
constexpr std::size_t kCheckpointEvery = 32;

}  // namespace

void Process::when_stored(std::function<void(const Result<void>&)> then) {
  if (setting_.disk == nullptr) return then({});
  waiting_.push_back(std::move(then));
  ask_commit(Instant(0));
}

void Process::ask_commit(Instant wait) {
  if (committing_) {
    commit_asked_ = true;
    return;
  }
  committing_ = true;
  later("commit", wait, [this] { commit(); });
}

Ready Process::take_ready() {
  Ready ready = member_.take_ready(std::exchange(values_due_, false) || failure_);
  if (!ready.refused) member_.partition()->add_values(ready.rows);
  return ready;
}

// Taken now, on the disk a moment later; a process that is killed meanwhile has stored it or not.
void Process::commit() {
  commit_asked_ = false;
  const auto waiting = std::make_shared<decltype(waiting_)>(std::exchange(waiting_, {}));
  const auto ready = std::make_shared<Ready>(take_ready());
  const auto longest = static_cast<std::size_t>(world_.plan.disk.count());
  const Instant disk(setting_.disk != nullptr ? world_.random.index(longest + 1) : 0);
  later("disk", disk, [this, ready, waiting] {
    perform(*ready);
    const Result<void> stored = failure_ ? tl::unexpected(*failure_) : Result<void>();
    for (const auto& then : *waiting) then(stored);
    committing_ = false;
    if (commit_asked_ || failure_) ask_commit(failure_ ? kRetryStoring : kPublishEvery);
  });
}

void Process::perform(const Ready& ready) {
  Result<void> stored;
  if (ready.refused) {
    stored = tl::unexpected(*ready.refused);
  } else if (setting_.disk != nullptr) {
    stored = setting_.disk->save(ready.rows, world_.timeline.now());
    if (world_.random.index(kCheckpointEvery) == 0) setting_.disk->checkpoint();
    failure_ = stored ? std::nullopt : std::optional<Error>(stored.error());
  }
  if (stored && ready.rows.absent) {
    for (const Absent& one : *ready.rows.absent) {
      if (one.kind != Absent::Kind::kForgotten) continue;
      auto& stored_last = world_.forgotten_by[one.partition][partition()];
      if (stored_last.first != one.since) stored_last = {one.since, world_.timeline.now()};
    }
  }
  if (stored || ready.refused) {
    const auto said = member_.stored(ready);
    for (const Page& page : ready.pages) {
      if (stored) world_.invariants.publishes(*this, page);
      pages_[page.number] = page;
      world_.network.publish(*this, page);
    }
    announce(said);
  } else {
    announce(member_.not_stored(ready));
  }
  for (const PendingReply& pending : ready.replies) {
    Reply reply = pending.reply;
    if (!stored) reply.body = stored.error();
    world_.invariants.replies(*this, reply);
    reply_to(process_of(pending.to), reply);
  }
  react();
}

void Process::save_values() {
  values_due_ = true;
  ask_commit(Instant(0));
  later("values", kSaveValuesEvery, [this] { save_values(); });
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
