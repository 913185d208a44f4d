#include "partition/requests.hpp"

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

template <class... Bodies>
bool is_one_of(const Request& request) {
  return (std::holds_alternative<Bodies>(request.body) || ...);
}

}  // namespace

bool is_read_only(const Request& request) {
  const auto* remove = std::get_if<RemoveRequest>(&request.body);
  if (remove != nullptr) return remove->tops.empty();
  const auto* handover = std::get_if<HandOverRequest>(&request.body);
  if (handover != nullptr) return handover->step == HandOverRequest::Step::kRead;
  return is_one_of<LookupRequest, HistoryRequest, JointsRequest, ConsistencyRequest, FramesRequest,
                   DescriptionRequest, MemoryRequest, TimeRequest>(request);
}

bool is_change(const Request& request) {
  // To read what is handed over keeps the frames as they are.
  if (std::holds_alternative<HandOverRequest>(request.body)) return true;
  return !is_read_only(request) && !std::holds_alternative<WatchRequest>(request.body);
}

bool is_of_structure(const Request& request) {
  return is_one_of<AddRequest, RemoveRequest, ForgetRequest, MoveRequest, HandOverRequest,
                   AdoptRequest>(request);
}

bool is_stored_first(const Request& request) {
  return is_of_structure(request) || is_one_of<CorrelateRequest, ReviseRequest>(request);
}

bool is_of_values(const Request& request) {
  return is_one_of<UpdateRequest, PartialUpdateRequest, JointUpdate, ReviseRequest, RewriteRequest>(
      request);
}

std::string describe(const Request& request) {
  std::string what;
  if (const auto* add = std::get_if<AddRequest>(&request.body)) {
    what = "add frame " + quote(request.id) + " under " + quote(add->parent);
  } else if (const auto* remove = std::get_if<RemoveRequest>(&request.body)) {
    what = "remove, with all below,";
    for (const std::string& top : remove->tops) what += " " + quote(top);
  } else if (const auto* forget = std::get_if<ForgetRequest>(&request.body)) {
    what = "forget partition " + quote(forget->partition);
  } else if (const auto* move = std::get_if<MoveRequest>(&request.body)) {
    what = "move frame " + quote(request.id) + " under " + quote(move->parent);
  } else if (const auto* handover = std::get_if<HandOverRequest>(&request.body)) {
    const bool ends = handover->step == HandOverRequest::Step::kCancel;
    const bool begins = handover->step == HandOverRequest::Step::kBegin;
    if (ends || begins) what = ends ? "do not hand over" : "hand over";
    if (ends || begins) what += " frame " + quote(request.id) + " to " + quote(handover->to);
  } else if (const auto* adopt = std::get_if<AdoptRequest>(&request.body)) {
    if (adopt->part.is_last) {
      what = "take over frame " + quote(request.id) + " from " + quote(adopt->from);
    }
  }
  return what;
}

std::string attempt_of(const Request& request) {
  const std::string frame = " frame " + quote(request.id);
  if (const auto* forget = std::get_if<ForgetRequest>(&request.body)) {
    return "forget partition " + quote(forget->partition);
  }
  if (!is_change(request)) return "look";
  if (std::holds_alternative<AddRequest>(request.body)) return "add" + frame;
  if (std::holds_alternative<RemoveRequest>(request.body)) return "remove" + frame;
  if (std::holds_alternative<MoveRequest>(request.body)) return "move" + frame;
  if (std::holds_alternative<ReviseRequest>(request.body)) return "observe" + frame;
  if (std::holds_alternative<CorrelateRequest>(request.body)) return "correlate" + frame;
  if (std::holds_alternative<JointUpdate>(request.body)) return "move joints";
  if (std::holds_alternative<RewriteRequest>(request.body)) return "rewrite" + frame;
  if (std::holds_alternative<HandOverRequest>(request.body)) return "hand over" + frame;
  if (std::holds_alternative<AdoptRequest>(request.body)) return "take over" + frame;
  return "update" + frame;
}

}  // namespace tfdude
