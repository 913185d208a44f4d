#include "calls/rewrite_task.hpp"

#include <algorithm>

#include "tfdude/base/id.hpp"

#include "calls/tasks.hpp"

namespace tfdude {

Result<void> RewriteTask::plan(const Directory& directory, Clock::time_point) {
  const auto frame = forest_.info(id_);
  if (!frame) return fail_about_frame(Errc::kUnknownFrame, "no frame " + quote(id_), id_);
  if (samples_.empty() || samples_.size() > kMaxRewritten) {
    return fail(samples_.empty() ? Errc::kInvalidInput : Errc::kTooMuch,
                "frame " + quote(id_) + ": " + std::to_string(samples_.size()) +
                    " samples to rewrite, of 1 to " + std::to_string(kMaxRewritten) + " at once");
  }
  auto route = route_to(directory, frame->owner, Request{0, id_, {}});
  if (!route) return tl::unexpected(std::move(route.error()));
  route_ = *std::move(route);
  sent_ = 0;
  send_next();
  return {};
}

void RewriteTask::send_next() {
  parts_.clear();
  while (parts_.size() < kAtOnce && sent_ < samples_.size()) {
    const std::size_t end = std::min(sent_ + kMostRewrittenAtOnce, samples_.size());
    // The last one comes when the owner has all others, and is answered when all is done.
    if (end == samples_.size() && !parts_.empty()) return;
    parts_.push_back(route_);
    parts_.back().request.body =
        RewriteRequest{number_,
                       interval_,
                       static_cast<std::uint32_t>(samples_.size()),
                       static_cast<std::uint32_t>(sent_),
                       {samples_.begin() + static_cast<std::ptrdiff_t>(sent_),
                        samples_.begin() + static_cast<std::ptrdiff_t>(end)}};
    sent_ = end;
  }
}

Result<Task::Next> RewriteTask::take(std::vector<Reply> replies, Clock::time_point) {
  auto done = outcome_of(replies);
  // Its process may be another one, or it was too slow to keep the first parts.
  if (!done && done.error().code == Errc::kChangedMeanwhile && ++torn_ < kAttempts) {
    return Next::kPlan;
  }
  if (!done) return tl::unexpected(std::move(done.error()));
  if (sent_ == samples_.size()) return Next::kDone;
  send_next();
  return Next::kAsk;
}

}  // namespace tfdude
