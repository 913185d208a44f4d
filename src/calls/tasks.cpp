#include "calls/tasks.hpp"

#include <algorithm>

namespace tfdude {
namespace {

const std::string& name_of(const JointValue& joint) { return joint.name; }
template <class Edge>
const std::string& name_of(const Edge& edge) {
  return edge.id;
}

// Calls a function with the values that a request changes, if it may be one of several.
template <class Body, class Use>
void with_values(Body& body, Use use) {
  if (auto* update = std::get_if<UpdateRequest>(&body)) return use(update->edges);
  if (auto* partial = std::get_if<PartialUpdateRequest>(&body)) return use(partial->edges);
  if (auto* joints = std::get_if<JointUpdate>(&body)) return use(joints->joints);
}

}  // namespace

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

Result<void> outcome_of_telling(std::vector<Reply> replies) {
  const auto may_not = [](const Reply& reply) {
    const auto* error = std::get_if<Error>(&reply.body);
    return error != nullptr && error->code == Errc::kNotPermitted;
  };
  if (!std::all_of(replies.begin(), replies.end(), may_not)) {
    replies.erase(std::remove_if(replies.begin(), replies.end(), may_not), replies.end());
  }
  return outcome_of(replies);
}

void AppliedValues::note(const std::vector<Part>& parts, const std::vector<Reply>& replies) {
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (std::holds_alternative<Error>(replies[i].body)) continue;
    with_values(parts[i].request.body, [&](const auto& values) {
      for (const auto& value : values) applied_.emplace(parts[i].owner, name_of(value));
    });
  }
}

void AppliedValues::leave_out(std::vector<Part>& parts) const {
  if (applied_.empty()) return;
  const auto is_done = [&](Part& part) {
    bool done = false;
    with_values(part.request.body, [&](auto& values) {
      const auto left = std::remove_if(values.begin(), values.end(), [&](const auto& value) {
        return applied_.count({part.owner, name_of(value)}) != 0;
      });
      values.erase(left, values.end());
      done = values.empty();
      // A request for edges has the id of its first one, another that of the partition.
      if (!done && !std::holds_alternative<JointUpdate>(part.request.body)) {
        part.request.id = name_of(values.front());
      }
    });
    return done;
  };
  parts.erase(std::remove_if(parts.begin(), parts.end(), is_done), parts.end());
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
