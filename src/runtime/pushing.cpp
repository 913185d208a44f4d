#include "runtime/pushing.hpp"

#include <utility>

#include "tfdude/base/id.hpp"

namespace tfdude {

void Pushing::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
  }
  if (pusher_ != nullptr) pusher_->stop();
}

Pusher* Pushing::pusher() {
  const std::lock_guard lock(mutex_);
  if (stopped_) return nullptr;
  if (pusher_ == nullptr) {
    pusher_ = std::make_unique<Pusher>(
        structure_.forest,
        [this](const State& state) {
          transport_.push(state);
          watcher_.on_state(state);
        },
        [this](std::uint64_t group) { transport_.end_pushing(group); });
  }
  return pusher_.get();
}

Reply Pushing::answer(const Request& request) {
  const std::string who = "partition " + quote(member_.name());
  Pusher* const pusher = this->pusher();
  if (pusher == nullptr) {
    return {request.sequence, 0, Error{Errc::kNotOwner, who + " is leaving"}};
  }
  const auto& watch = std::get<WatchRequest>(request.body);
  const std::uint64_t incarnation =
      member_.with_rules([](const Member& member) { return member.presence().incarnation; });
  auto state = pusher->watch(watch_group(member_.name(), incarnation, watch), watch);
  if (!state) return {request.sequence, 0, std::move(state.error())};
  if (correlated_entries(*state) > kMaxCorrelated) {
    return {request.sequence, 0,
            Error{Errc::kInvalidInput, who + " has more than " + std::to_string(kMaxCorrelated) +
                                           " edges of the path that are correlated with others"}};
  }
  return {request.sequence, 0, *std::move(state)};
}

void Pushing::on_watcher(std::uint64_t group) {
  const std::lock_guard lock(mutex_);
  if (pusher_ != nullptr) pusher_->tell_all(group);
}

}  // namespace tfdude
