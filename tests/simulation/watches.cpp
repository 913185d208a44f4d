#include "simulation/watches.hpp"

#include <algorithm>
#include <utility>

#include "simulation/process.hpp"

namespace tfdude::simulation {

Watches::Watches(Process& process)
    : process_(process), rounds_(process.replies(), RunningCall::kTimeout) {}

TimeLimit::Clock::time_point Watches::now() const { return process_.world().timeline.steady(); }

void Watches::add(const std::shared_ptr<WatchedPath>& path, std::function<void()> shown) {
  shown_.emplace_back(path, std::move(shown));
  rounds_.add(path);
  ask_by(now());
}

void Watches::look_again() {
  if (rounds_.look_again()) ask_by(now());
}

// As a job of a Loop: asked for while it runs, it runs once more.
void Watches::ask_by(Clock::time_point time) {
  if (time >= due_) return;
  due_ = time;
  if (!in_round_) wake();
}

void Watches::wake() {
  if (due_ == WatchRounds::kNever) return;
  process_.later("watch", std::max(due_ - now(), Instant(0)), [this, due = due_] {
    if (in_round_ || due_ != due) return;
    in_round_ = true;
    due_ = WatchRounds::kNever;
    rounds_.begin(now());
    step();
  });
}

void Watches::show() {
  for (const auto& [path, shown] : shown_) {
    if (!path.expired()) shown();
  }
}

void Watches::step() {
  asked_ = rounds_.step(now(), *this);
  show();
  if (asked_ != nullptr) {
    ++asks_;
    return send();
  }
  in_round_ = false;
  due_ = std::min(due_, rounds_.next());
  wake();
}

void Watches::send() {
  const auto next = asked_->step(now(), process_);
  if (asked_->complete()) return step();
  process_.later("watch call", next - now(), [this, asks = asks_] {
    if (asked_ != nullptr && asks_ == asks) send();
  });
}

void Watches::go_on() {
  if (asked_ != nullptr && asked_->complete()) step();
}

Result<void> Watches::plan(Watched& watched) {
  return watched.plan({process_.forest(), process_.directory(), 0});
}

// DDS matches a reader a moment after its creation; the owner then sends everything again.
Result<void> Watches::open(const std::string& partition, std::uint64_t group) {
  opened_.insert(group);
  const auto wait = std::chrono::microseconds(process_.world().random.index(50'000));
  process_.later("match", wait, [this, partition, group] {
    if (opened_.count(group) == 0) return;
    heard_.insert(group);
    process_.listen(partition, group);
  });
  return {};
}

void Watches::close(std::uint64_t group) {
  opened_.erase(group);
  heard_.erase(group);
}

// A DDS reader drops a sample that arrives after a later sample of the same writer.
void Watches::on_pushed(std::uint64_t from, std::uint64_t number, const PushedValues& pushed) {
  if (heard_.count(pushed.group) == 0) return;
  std::uint64_t& newest = newest_[from];
  if (number <= newest) return;
  newest = number;
  process_.world().count("something was pushed");
  ask_by(rounds_.on_pushed(pushed, now()));
  show();
}

}  // namespace tfdude::simulation
