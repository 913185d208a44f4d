#include <thread>
#include <utility>
#include <vector>

#include "runtime/memory_reads.hpp"
#include "runtime/watched_path.hpp"
#include "tree/epoch.hpp"

// Watched paths that are read in the memory of their owners.
namespace tfdude {
namespace {

// How often memory is read while the path changes its route: some milliseconds.
constexpr int kMostReads = 1000;

// Whether the structure here and that in memory differ, or the memory is being written.
bool is_rerouting(const Error& why) {
  return why.code != Errc::kNotYet && why.code != Errc::kTooOld;
}

}  // namespace

bool WatchedPath::read_memory(Clock::time_point now) {
  bool rerouted = false;
  bool begins = false;
  {
    const Lock lock(mutex_);
    next_.reset();
    begins = !in_memory() || !route_in_memory_->is_same(planned_);
    if (begins) {
      const bool same = followed_ != nullptr && followed_->route().is_same(planned_);
      rerouted = std::exchange(was_shown_, true) && !same;
      asked_for_history_ = 0;
      route_in_memory_ = std::move(planned_);
      written_.reset();
      // In this order readers find one of both.
      memory_.store(others_, std::memory_order_seq_cst);
      if (followed_ != nullptr) show(nullptr);
    }
  }
  (void)look(now);
  if (begins) tell();
  return rerouted;
}

Result<StampedTransform> WatchedPath::lookup_in(MemoryReads& memory, const Query& query) const {
  auto found = memory.lookup_kept(a_, b_, query);
  if (!wants_newest(query)) {
    if (!found) explain(memory, query, found.error());
    return found;
  }
  for (int i = 0; !found && i < kMostReads; ++i) {
    if (i > 0) {
      std::this_thread::yield();
      found = memory.lookup_kept(a_, b_, query);
    }
    // The structure here may be behind that in memory: then what was there before counts, which is
    // not older than what others have read.
    if (!found && is_rerouting(found.error())) found = memory.lookup_former(a_, b_);
    if (found) continue;
    // An owner returns as another process: nobody can read it until its memory is known here.
    const bool rerouting = is_rerouting(found.error());
    if (rerouting && reads_all(memory)) continue;
    if (found.error().code == Errc::kNotYet) break;
    // Its edges have no instant in common, perhaps because they are others now. If others have read
    // a later one since, they have.
    if (auto shown = shown_before()) return *std::move(shown);
  }
  if (!found) {
    explain(memory, query, found.error());
    return found;
  }
  if (found->stamp) note_read(nanoseconds(*found->stamp));
  return found;
}

void WatchedPath::note_read(std::int64_t stamp) const {
  std::int64_t latest = latest_read_.load(std::memory_order_relaxed);
  while (stamp > latest && !latest_read_.compare_exchange_weak(latest, stamp)) {
  }
}

bool WatchedPath::reads_all(MemoryReads& memory) const {
  std::vector<Part> parts;
  {
    const Lock lock(mutex_);
    if (route_in_memory_) parts = route_in_memory_->parts;
  }
  return memory.can_watch(parts);
}

std::optional<StampedTransform> WatchedPath::shown_before() const {
  const auto goes_on = [this](const StampedTransform& X) {
    return !X.stamp || nanoseconds(*X.stamp) >= latest_read_.load(std::memory_order_relaxed);
  };
  const auto* held = held_.load(std::memory_order_seq_cst);
  if (held != nullptr && goes_on(*held)) return *held;
  const Lock lock(mutex_);
  if (newest_ && goes_on(*newest_)) return *newest_;
  return std::nullopt;
}

void WatchedPath::explain(const MemoryReads& memory, const Query& query, Error& why) const {
  why = memory.explained(std::move(why), a_, b_, query);
  if (why.message.empty()) why = {Errc::kNotYet, "the " + described() + " changes its route"};
}

Watched::Looked WatchedPath::look(Clock::time_point now) {
  {
    const epoch::Guard guard;
    MemoryReads* memory = memory_.load(std::memory_order_seq_cst);
    if (memory == nullptr) return {};
    const auto written = memory->written(a_, b_);
    const Lock lock(mutex_);
    if (!in_memory()) return {};
    if (!written) {
      // Before it is overwritten.
      if (auto former = memory->lookup_former(a_, b_)) remember(std::move(former));
      return {};
    }
    if (written == written_) return {};
    auto newest = memory->lookup_kept(a_, b_, {});
    const bool goes_back = newest && newest_ && newest->stamp < newest_->stamp;
    if (now < tell_from_) {
      // Readers have it before it is told. It is shown again while an owner is gone.
      if (written_ && newest && !goes_back) remember(std::move(newest));
      return {false, tell_from_};
    }
    if (options_.rate > 0) tell_from_ = now + watch_period(options_.rate);
    const bool begins = !std::exchange(written_, written);
    // What a mirror has shown before is not new.
    const bool known =
        begins && newest && newest_ && newest->stamp == newest_->stamp && same(*newest, *newest_);
    // A clock was set back, or the end of the past was rewritten.
    if (goes_back) forget_newest();
    remember(std::move(newest));
    if (known) return {};
    messages_.fetch_add(1, std::memory_order_relaxed);
  }
  tell();
  return {true};
}

std::set<Owner> WatchedPath::owners_in_memory() const {
  std::set<Owner> owners;
  const Lock lock(mutex_);
  if (!route_in_memory_) return owners;
  for (const Part& part : route_in_memory_->parts) owners.insert(part.owner);
  return owners;
}

}  // namespace tfdude
