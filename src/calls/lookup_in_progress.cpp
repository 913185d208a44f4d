#include "calls/lookup_in_progress.hpp"

#include <utility>

#include "tfdude/base/id.hpp"

#include "partition/assembly.hpp"

namespace tfdude {
namespace {

// The index of the answer whose newest instant is the oldest.
std::size_t slowest(const std::vector<SegmentValues>& answers) {
  std::size_t found = 0;
  for (std::size_t i = 1; i < answers.size(); ++i) {
    const auto& oldest = answers[found].stamp;
    if (answers[i].stamp && (!oldest || *answers[i].stamp < *oldest)) found = i;
  }
  return found;
}

}  // namespace

std::string other_clock(const Directory& directory, ClockKind own, const std::vector<Part>& parts) {
  for (const Part& part : parts) {
    const auto theirs = part.owner == kHeldHere ? std::nullopt : directory.info(part.owner).clock;
    if (!theirs || *theirs == own) continue;
    return "partition " + quote(part.partition) + " uses the " + to_string(*theirs) +
           " clock, and this participant the " + to_string(own) + " clock";
  }
  return {};
}

Result<std::vector<SegmentValues>> values_of(std::vector<Reply> replies) {
  std::vector<SegmentValues> answers;
  answers.reserve(replies.size());
  for (Reply& reply : replies) {
    if (auto* error = std::get_if<Error>(&reply.body)) return tl::unexpected(std::move(*error));
    auto* values = std::get_if<SegmentValues>(&reply.body);
    answers.push_back(values != nullptr ? std::move(*values) : SegmentValues());
  }
  return answers;
}

Result<LookupInProgress> LookupInProgress::plan(const Forest& forest, const Directory& directory,
                                                ClockKind own, const WantedLookup& wanted,
                                                const SharedHints& hints, SharedHints::Steady now) {
  const Query& query = wanted.query;
  // Hints are for what is known now.
  const bool guesses = !query.at && !query.believed_at;
  const auto hint = guesses ? hints.guess(wanted.a, wanted.b, now) : std::nullopt;
  auto plan = route_lookup(forest, directory, wanted.a, wanted.b, query, hint);
  if (!plan) return tl::unexpected(std::move(plan.error()));
  LookupInProgress lookup(*std::move(plan), wanted, hint, now);
  lookup.differs_ = other_clock(directory, own, lookup.parts());
  // The age of an instant is a difference of two times, which must be of one clock.
  if (!query.age_noise_until || lookup.differs_.empty()) return lookup;
  return fail(Errc::kInvalidInput,
              "no process noise can be added until another instant: " + lookup.differs_);
}

Error LookupInProgress::explained(Error error) const {
  if (error.code != Errc::kTooOld && error.code != Errc::kNotYet) return error;
  const auto& at = plan_.parts.empty()
                       ? std::nullopt
                       : std::get<LookupRequest>(plan_.parts.front().request.body).query.at;
  if (error.code == Errc::kTooOld && slowest_ && at) {
    error.message.insert(0, "there is no latest common time: the newest of partition " +
                                quote(plan_.parts[*slowest_].partition) + " is " + readable(*at) +
                                "; ");
  }
  if (!differs_.empty()) error.message += "; " + differs_;
  return error;
}

std::optional<Result<StampedTransform>> LookupInProgress::take(std::vector<Reply> replies,
                                                               SharedHints& hints,
                                                               SharedHints::Steady now) {
  auto answers = values_of(std::move(replies));
  if (!answers) return tl::unexpected(explained(std::move(answers.error())));
  // In a second round the parts name the instant.
  const bool newest =
      !plan_.parts.empty() && !std::get<LookupRequest>(plan_.parts.front().request.body).query.at;
  if (!newest || plan_.parts.size() == 1) return assembled(*answers);
  if (!believed_) hints.note(a_, b_, planned_, now, *answers);
  slowest_ = slowest(*answers);
  OneInstant found = one_instant(*std::move(answers), hint_);
  if (!found.ask_again) return assembled(found.answers);
  for (Part& part : plan_.parts) {
    auto& lookup = std::get<LookupRequest>(part.request.body);
    // The hint says that this is the latest common time.
    lookup.query.at = lookup.hint = found.ask_again;
  }
  return std::nullopt;
}

Result<StampedTransform> LookupInProgress::assembled(
    const std::vector<SegmentValues>& answers) const {
  auto X_AB = assemble(plan_, answers);
  if (!X_AB) return tl::unexpected(explained(std::move(X_AB.error())));
  return X_AB;
}

Result<void> LookupTask::plan(const Directory& directory, Clock::time_point now) {
  auto planned = LookupInProgress::plan(forest_, directory, own_, wanted_, hints_, now);
  if (!planned) return tl::unexpected(std::move(planned.error()));
  lookup_.emplace(*std::move(planned));
  return {};
}

Result<Task::Next> LookupTask::take(std::vector<Reply> replies, Clock::time_point now) {
  auto found = lookup_->take(std::move(replies), hints_, now);
  if (!found) return Next::kAsk;
  if (!*found) return tl::unexpected(std::move(found->error()));
  X_AB_.emplace(**std::move(found));
  return Next::kDone;
}

}  // namespace tfdude
