#include "calls/one_state_task.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

#include "tfdude/base/id.hpp"

#include "calls/lookup_in_progress.hpp"
#include "tree/pushed_value.hpp"

namespace tfdude {
namespace {

// What was read in memory names no process, but its commits are those that the process counts.
bool is_before(const SegmentValues& earlier, const SegmentValues& later) {
  const bool is_known = earlier.incarnation != 0 && later.incarnation != 0;
  if (is_known && earlier.incarnation != later.incarnation) return false;
  return earlier.commit == 0 || later.commit == 0 || earlier.commit <= later.commit;
}

bool says_the_same(const SegmentValues& one, const SegmentValues& other) {
  const auto is_as = [](const PathCorrelation& a, const PathCorrelation& b) {
    const bool knows_as_little = a.unknown && b.unknown ? a.unknown->upper() == b.unknown->upper()
                                                        : !a.unknown && !b.unknown;
    return knows_as_little && a.common_errors == b.common_errors &&
           a.observed_with == b.observed_with;
  };
  return std::equal(one.values.begin(), one.values.end(), other.values.begin(), other.values.end(),
                    same) &&
         std::equal(one.correlations.begin(), one.correlations.end(), other.correlations.begin(),
                    other.correlations.end(), is_as);
}

}  // namespace

std::vector<std::string> OneStateTask::frames() const {
  std::vector<std::string> frames;
  for (const Read& read : reads_) {
    frames.push_back(read.a);
    frames.push_back(read.b);
  }
  return frames;
}

Result<void> OneStateTask::plan(const Directory& directory, Clock::time_point) {
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
  ask_all();
  return {};
}

void OneStateTask::ask_all() {
  ask_again_but_the_last();
  compares_ = false;
  parts_.insert(parts_.end(), plans_.back().parts.begin(), plans_.back().parts.end());
}

void OneStateTask::ask_again_but_the_last() {
  compares_ = true;
  parts_.clear();
  for (std::size_t i = 0; i + 1 < plans_.size(); ++i) {
    parts_.insert(parts_.end(), plans_[i].parts.begin(), plans_[i].parts.end());
  }
}

Result<Task::Next> OneStateTask::take(std::vector<Reply> replies, Clock::time_point) {
  auto values = values_of(std::move(replies));
  if (!values) return tl::unexpected(std::move(values.error()));
  std::vector<Answers> answers(compares_ ? reads_.size() - 1 : reads_.size());
  auto next = std::make_move_iterator(values->begin());
  for (std::size_t i = 0; i < answers.size(); ++i) {
    const auto end = next + static_cast<std::ptrdiff_t>(plans_[i].parts.size());
    answers[i].assign(next, end);
    next = end;
  }
  if (compares_) {
    if (are_unchanged(answers)) return conclude();
    if (tries_ < kMostTries) return ask_all(), Next::kAsk;
    return fail(Errc::kChangedMeanwhile, "edges between " + quote(reads_.back().a) + " and " +
                                             quote(reads_.back().b) + " are changed all the time");
  }
  answers_ = std::move(answers);
  if (are_of_one_state()) return conclude();
  if (++tries_ < kTriesForOneCommit) return ask_all(), Next::kAsk;
  // Such an owner does not change these paths at their instants with most of its commits.
  ask_again_but_the_last();
  return Next::kAsk;
}

bool OneStateTask::are_of_one_state() const {
  std::map<Owner, const SegmentValues*> firsts;
  for (std::size_t i = 0; i < answers_.size(); ++i) {
    // States that are meant to be several.
    if (reads_[i].query.believed_at != reads_[0].query.believed_at) return true;
    for (std::size_t k = 0; k < answers_[i].size(); ++k) {
      const SegmentValues& one = answers_[i][k];
      const auto [first, is_new] = firsts.try_emplace(plans_[i].parts[k].owner, &one);
      if (is_new) continue;
      const bool is_known = one.commit != 0;
      if (!is_known || one.commit != first->second->commit ||
          one.incarnation != first->second->incarnation) {
        return false;
      }
    }
  }
  return true;
}

// What is the same before and after the last read was so during it.
bool OneStateTask::are_unchanged(const std::vector<Answers>& again) const {
  for (std::size_t i = 0; i < again.size(); ++i) {
    if (again[i].size() != answers_[i].size()) return false;
    for (std::size_t k = 0; k < again[i].size(); ++k) {
      const SegmentValues& first = answers_[i][k];
      for (std::size_t n = 0; n < answers_.back().size(); ++n) {
        if (plans_[i].parts[k].owner != plans_.back().parts[n].owner) continue;
        const SegmentValues& last = answers_.back()[n];
        if (!is_before(first, last) || !is_before(last, again[i][k])) return false;
      }
      if (!says_the_same(first, again[i][k])) return false;
    }
  }
  return true;
}

Result<Task::Next> OneStateTask::conclude() {
  for (std::size_t i = 0; i < reads_.size(); ++i) {
    auto path = observed_path(plans_[i], answers_[i]);
    if (!path) return tl::unexpected(std::move(path.error()));
    paths_[i] = *std::move(path);
  }
  return Next::kDone;
}

Pose OneStateTask::pose(std::size_t read) const {
  Pose X_AB;
  const auto& planned = plans_[read].edges;
  for (std::size_t i = 0; i < planned.size(); ++i) {
    const Pose& X_PC = paths_[read].edges[i].X_PC.pose;
    X_AB = X_AB * (planned[i].way == ObservedEdge::Way::kUp ? X_PC.inverse() : X_PC);
  }
  return X_AB;
}

}  // namespace tfdude
