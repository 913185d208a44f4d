#include "calls/instants_task.hpp"

#include <iterator>
#include <utility>

#include "partition/assembly.hpp"

namespace tfdude {
namespace {

// What the owners said of the second instant; empty if one of them has not.
std::optional<std::vector<SegmentValues>> at_hint(const std::vector<SegmentValues>& answers,
                                                  Time at, Time hint) {
  std::vector<SegmentValues> then = answers;
  for (SegmentValues& answer : then) {
    if (!answer.stamp || at == hint) continue;  // it holds for all times, or is of this one
    if (answer.at_hint.values.empty()) return std::nullopt;
    static_cast<ValuesAtInstant&>(answer) = std::move(answer.at_hint);
    answer.stamp = hint;
  }
  return then;
}

}  // namespace

InstantsTask::InstantsTask(const Forest& forest, ClockKind own, WantedLookup wanted,
                           std::vector<Time> instants)
    : forest_(forest),
      own_(own),
      wanted_(std::move(wanted)),
      instants_(std::move(instants)),
      found_(instants_.size(), tl::unexpected(Error{Errc::kTimeout, "not asked"})) {}

Result<void> InstantsTask::plan(const Directory& directory, Clock::time_point) {
  auto planned = route_lookup(forest_, directory, wanted_.a, wanted_.b, wanted_.query);
  if (!planned) return tl::unexpected(std::move(planned.error()));
  plan_ = *std::move(planned);
  differs_ = other_clock(directory, own_, plan_.parts);
  if (wanted_.query.age_noise_until && !differs_.empty()) {
    return fail(Errc::kInvalidInput,
                "no process noise can be added until another instant: " + differs_);
  }
  asked_.clear();
  for (std::size_t i = 0; i < instants_.size(); i += 2) {
    asked_.push_back({i, i + 1 < instants_.size() ? std::optional(i + 1) : std::nullopt});
  }
  ask();
  return {};
}

void InstantsTask::ask() {
  parts_.clear();
  for (const Asked& asked : asked_) {
    for (const Part& part : plan_.parts) {
      auto& lookup = std::get<LookupRequest>(parts_.emplace_back(part).request.body);
      lookup.query.at = instants_[asked.first];
      lookup.hint.reset();
      // The instant itself, as the hint, would say that it is the latest common time.
      if (asked.second && instants_[*asked.second] != instants_[asked.first]) {
        lookup.hint = instants_[*asked.second];
      }
    }
  }
}

void InstantsTask::conclude(std::size_t i, Found found) {
  const auto of_time = [](Errc code) { return code == Errc::kTooOld || code == Errc::kNotYet; };
  if (!found && !differs_.empty() && of_time(found.error().code)) {
    found.error().message += "; " + differs_;
  }
  found_[i] = std::move(found);
}

void InstantsTask::take(const Asked& asked, std::vector<Reply> replies) {
  auto answers = values_of(std::move(replies));
  std::optional<std::vector<SegmentValues>> second;
  if (answers) {
    if (asked.second) second = at_hint(*answers, instants_[asked.first], instants_[*asked.second]);
    conclude(asked.first, assemble(plan_, *answers));
  } else {
    conclude(asked.first, tl::unexpected(std::move(answers.error())));
  }
  if (!asked.second) return;
  if (second) {
    conclude(*asked.second, assemble(plan_, *second));
  } else {
    asked_.push_back({*asked.second, std::nullopt});
  }
}

Result<Task::Next> InstantsTask::take(std::vector<Reply> replies, Clock::time_point) {
  for (const Reply& reply : replies) {
    const auto* error = std::get_if<Error>(&reply.body);
    // Of one instant only; anything else concerns all of them.
    if (error == nullptr || error->code == Errc::kTooOld || error->code == Errc::kNotYet) continue;
    return tl::unexpected(*error);
  }
  const std::vector<Asked> asked = std::exchange(asked_, {});
  const auto each = static_cast<std::ptrdiff_t>(plan_.parts.size());
  auto from = replies.begin();
  for (const Asked& one : asked) {
    take(one, {std::make_move_iterator(from), std::make_move_iterator(from + each)});
    from += each;
  }
  ask();
  return asked_.empty() ? Next::kDone : Next::kAsk;
}

}  // namespace tfdude
