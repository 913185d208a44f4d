#include "calls/two_reads_task.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "tfdude/base/id.hpp"

#include "calls/lookup_in_progress.hpp"
#include "tree/pushed_value.hpp"

namespace tfdude {
namespace {

// What was read in memory names no process, and counts for itself.
bool is_before(const SegmentValues& earlier, const SegmentValues& later) {
  const bool of_both = (earlier.incarnation == 0) != (later.incarnation == 0);
  return of_both || (earlier.incarnation == later.incarnation && earlier.commit <= later.commit);
}

}  // namespace

std::vector<std::string> TwoReadsTask::frames() const {
  return {reads_[0].a, reads_[0].b, reads_[1].a, reads_[1].b};
}

Result<void> TwoReadsTask::plan(const Directory& directory, Clock::time_point) {
  for (std::size_t i = 0; i < reads_.size(); ++i) {
    const auto& [a, b, query] = reads_[i];
    auto planned = route_observe(forest_, directory, a, b, {}, query.at);
    if (!planned) return tl::unexpected(std::move(planned.error()));
    plans_[i] = *std::move(planned);
    for (Part& part : plans_[i].parts) {
      auto& request = std::get<LookupRequest>(part.request.body);
      request.query = query;
      request.timed = timed_;
    }
  }
  ask_both();
  return {};
}

void TwoReadsTask::ask_both() {
  asks_first_again_ = false;
  parts_ = plans_[0].parts;
  parts_.insert(parts_.end(), plans_[1].parts.begin(), plans_[1].parts.end());
}

Result<Task::Next> TwoReadsTask::take(std::vector<Reply> replies, Clock::time_point) {
  auto answers = values_of(std::move(replies));
  if (!answers) return tl::unexpected(std::move(answers.error()));
  if (asks_first_again_) {
    if (is_first_unchanged(*answers)) return conclude();
    if (tries_ < kMostTries) return ask_both(), Next::kAsk;
    return fail(Errc::kChangedMeanwhile, "edges between " + quote(reads_[1].a) + " and " +
                                             quote(reads_[1].b) + " are changed all the time");
  }
  const auto middle = answers->begin() + static_cast<std::ptrdiff_t>(plans_[0].parts.size());
  answers_[0].assign(std::make_move_iterator(answers->begin()), std::make_move_iterator(middle));
  answers_[1].assign(std::make_move_iterator(middle), std::make_move_iterator(answers->end()));
  if (are_of_one_state()) return conclude();
  if (++tries_ < kTriesForOneCommit) return ask_both(), Next::kAsk;
  // Such an owner changes neither path at its instant with most of its commits.
  asks_first_again_ = true;
  parts_ = plans_[0].parts;
  return Next::kAsk;
}

bool TwoReadsTask::are_of_one_state() const {
  // States that are meant to be two.
  if (reads_[0].query.believed_at != reads_[1].query.believed_at) return true;
  for (std::size_t i = 0; i < answers_[0].size(); ++i) {
    for (std::size_t k = 0; k < answers_[1].size(); ++k) {
      if (plans_[0].parts[i].owner != plans_[1].parts[k].owner) continue;
      const SegmentValues& first = answers_[0][i];
      const SegmentValues& second = answers_[1][k];
      const bool is_known = first.commit != 0;
      if (!is_known || first.commit != second.commit || first.incarnation != second.incarnation) {
        return false;
      }
    }
  }
  return true;
}

// What is the same before and after the second read was so during it.
bool TwoReadsTask::is_first_unchanged(const Answers& again) const {
  if (again.size() != answers_[0].size()) return false;
  for (std::size_t i = 0; i < again.size(); ++i) {
    const SegmentValues& first = answers_[0][i];
    for (std::size_t k = 0; k < answers_[1].size(); ++k) {
      if (plans_[0].parts[i].owner != plans_[1].parts[k].owner) continue;
      const SegmentValues& second = answers_[1][k];
      if (!is_before(first, second) || !is_before(second, again[i])) return false;
    }
    if (!std::equal(first.values.begin(), first.values.end(), again[i].values.begin(),
                    again[i].values.end(), same)) {
      return false;
    }
  }
  return true;
}

Result<Task::Next> TwoReadsTask::conclude() {
  for (std::size_t i = 0; i < reads_.size(); ++i) {
    auto path = observed_path(plans_[i], answers_[i]);
    if (!path) return tl::unexpected(std::move(path.error()));
    paths_[i] = *std::move(path);
  }
  return Next::kDone;
}

}  // namespace tfdude
