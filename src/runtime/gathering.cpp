#include "runtime/gathering.hpp"

#include <utility>

namespace tfdude {

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

std::optional<Result<StampedTransform>> Gathering::take(std::vector<Reply> replies,
                                                        SharedHints& hints) {
  auto answers = values_of(std::move(replies));
  if (!answers) return tl::unexpected(std::move(answers.error()));
  // In a second round the parts name the instant.
  const bool newest =
      !plan_.parts.empty() && !std::get<LookupRequest>(plan_.parts.front().request.body).query.at;
  if (!newest || plan_.parts.size() == 1) return assemble(plan_, *answers);
  hints.note(a_, b_, *answers);
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
