#include "runtime/commit_loop.hpp"

#include <utility>

namespace tfdude {

CommitLoop::CommitLoop(std::unique_ptr<StateStore> store, Effects& effects, Periods periods)
    : store_(std::move(store)),
      commits_(effects, periods, store_ != nullptr),
      rounds_(loop_, [this] { return run(); }) {}

Result<void> CommitLoop::start() {
  if (auto begun = loop_.begin(); !begun) return begun;
  auto stored = round();
  if (stored) rounds_.ask();
  return stored;
}

void CommitLoop::stop() {
  rounds_.stop();
  if (!commits_.started() || std::exchange(ended_, true)) return;
  (void)round(true);
  commits_.end();
}

Result<void> CommitLoop::flush(Clock::time_point deadline) {
  const auto mine = commits_.want();
  rounds_.ask();
  return commits_.wait(mine, deadline);
}

CommitLoop::Clock::time_point CommitLoop::run() {
  if (commits_.next() <= Clock::now()) (void)round();
  return commits_.next();
}

Result<void> CommitLoop::round(bool values) {
  const Ready ready = commits_.begin(Clock::now(), values);
  Result<void> stored;
  Result<void> room;
  if (ready.refused) {
    stored = tl::unexpected(*ready.refused);
  } else if (store_ != nullptr && !ready.rows.empty()) {
    stored = store_->save(ready.rows);
  }
  if (store_ != nullptr && stored) room = store_->make_room();
  commits_.finish(ready, stored, room, Clock::now());
  return stored;
}

}  // namespace tfdude
