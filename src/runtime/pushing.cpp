#include "runtime/pushing.hpp"

#include <utility>

#include "tfdude/base/id.hpp"

#include "base/mutex.hpp"

namespace tfdude {

void Pushing::stop() {
  Pusher* pusher = nullptr;
  {
    const Lock lock(mutex_);
    stopped_ = true;
    pusher = pusher_.get();
  }
  if (pusher != nullptr) pusher->stop();
}

Pusher* Pushing::pusher() {
  const Lock lock(mutex_);
  if (stopped_) return nullptr;
  if (pusher_ == nullptr) {
    pusher_ = std::make_unique<Pusher>(
        structure_.forest, max_groups_,
        [this](const PushedValues& pushed) {
          transport_.push(pushed);
          watcher_.on_pushed(pushed);
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
  auto pushed = pusher->watch(watch_group(member_.name(), incarnation, watch), watch);
  if (!pushed) {
    if (pushed.error().code == Errc::kTooMuch) pushed = fail_at(who, pushed.error());
    return {request.sequence, 0, std::move(pushed.error())};
  }
  if (correlated_entries(*pushed) > kMaxCorrelated) {
    return {request.sequence, 0,
            Error{Errc::kInvalidInput, who + " has more than " + std::to_string(kMaxCorrelated) +
                                           " edges of the path that are correlated with others"}};
  }
  return {request.sequence, 0, *std::move(pushed)};
}

std::uint64_t Pushing::refused() {
  const Lock lock(mutex_);
  return pusher_ != nullptr ? pusher_->refused() : 0;
}

void Pushing::on_watcher(std::uint64_t group) {
  Pusher* pusher = nullptr;
  {
    const Lock lock(mutex_);
    pusher = pusher_.get();
  }
  if (pusher != nullptr) pusher->tell_all(group);
}

}  // namespace tfdude
