#include "runtime/gathering.hpp"

#include <utility>

#include "tfdude/base/id.hpp"

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

Error Gathering::explained(Error error) const {
  if (!slowest_ || error.code != Errc::kTooOld) return error;
  const auto& at = std::get<LookupRequest>(plan_.parts[*slowest_].request.body).query.at;
  if (!at) return error;
  error.message.insert(0, "there is no latest common time: the newest of partition " +
                              quote(plan_.parts[*slowest_].partition) + " is " + readable(*at) +
                              "; ");
  return error;
}

std::optional<Result<StampedTransform>> Gathering::take(std::vector<Reply> replies,
                                                        SharedHints& hints) {
  auto answers = values_of(std::move(replies));
  if (!answers) return tl::unexpected(explained(std::move(answers.error())));
  // In a second round the parts name the instant.
  const bool newest =
      !plan_.parts.empty() && !std::get<LookupRequest>(plan_.parts.front().request.body).query.at;
  if (!newest || plan_.parts.size() == 1) return assemble(plan_, *answers);
  hints.note(a_, b_, *answers);
  slowest_ = slowest(*answers);
  OneInstant found = one_instant(*std::move(answers), hint_);
  if (!found.ask_again) return assemble(plan_, found.answers);
  for (Part& part : plan_.parts) {
    auto& lookup = std::get<LookupRequest>(part.request.body);
    // The hint says that this is the latest common time.
    lookup.query.at = lookup.hint = found.ask_again;
  }
  return std::nullopt;
}

}  // namespace tfdude
