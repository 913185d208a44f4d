#include "calls/tasks.hpp"

namespace tfdude {

Result<void> outcome_of(const std::vector<Reply>& replies) {
  Result<void> outcome;
  for (const Reply& reply : replies) {
    const auto* error = std::get_if<Error>(&reply.body);
    if (error != nullptr && (outcome || error->code == Errc::kState)) {
      outcome = tl::unexpected(*error);
    }
  }
  return outcome;
}

Result<void> CatchUpTask::plan(const Directory& directory, Clock::time_point) {
  parts_.clear();
  for (const Owner owner : directory.reachable_owners()) {
    const std::string& name = directory.name(owner);
    parts_.push_back({owner, name, Request{0, name, RemoveRequest{}}});
  }
  return {};
}

Result<Task::Next> CatchUpTask::take(std::vector<Reply> replies, Clock::time_point) {
  replies_ = std::move(replies);
  return Next::kDone;
}

bool CatchUpTask::caught_up(const Directory& directory) const {
  if (replies_.size() != parts_.size()) return false;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const bool answered = std::holds_alternative<Done>(replies_[i].body);
    const bool here = answered && directory.epoch(parts_[i].owner) >= replies_[i].epoch;
    if (!here && directory.reachable(parts_[i].owner)) return false;
  }
  return true;
}

}  // namespace tfdude
