#include "calls/observe_task.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "tfdude/base/id.hpp"

#include "calls/lookup_in_progress.hpp"
#include "partition/latest.hpp"

namespace tfdude {
namespace {

// How often to repeat an observation if edges were written meanwhile, or were observed with still
// others.
constexpr int kObserveAttempts = 8;

// How often, and for how long, to wait for another observation to reach all owners.
constexpr int kTornAttempts = 5;
constexpr Milliseconds kTornPause{1};

}  // namespace

ObserveTask::ObserveTask(const Forest& forest, Measurement measurement, std::string source,
                         bool asks_for_frames, const TimeLimit& limit)
    : forest_(forest),
      measurement_(std::move(measurement)),
      source_(std::move(source)),
      asks_for_frames_(asks_for_frames),
      limit_(limit) {}

std::vector<std::string> ObserveTask::frames() const {
  std::vector<std::string> all{measurement_.a, measurement_.b};
  all.insert(all.end(), beside_.begin(), beside_.end());
  all.insert(all.end(), unknown_.begin(), unknown_.end());
  return all;
}

Result<void> ObserveTask::plan(const Directory& directory, Clock::time_point) {
  stage_ = Stage::kNewest;
  const auto& [a, b, X_AB, stamp, options] = measurement_;
  auto planned = route_observe(forest_, directory, a, b, beside_, stamp);
  if (!planned) return tl::unexpected(std::move(planned.error()));
  plan_ = *std::move(planned);
  return {};
}

Result<Task::Next> ObserveTask::take(std::vector<Reply> replies, Clock::time_point now) {
  switch (stage_) {
    case Stage::kNewest:
    case Stage::kInstant:
      return values(std::move(replies), now);
    case Stage::kFirst:
      return first(std::move(replies.front()));
    case Stage::kOthers:
      break;
  }
  return others(replies);
}

// The values of all edges of the plan, at one instant.
Result<Task::Next> ObserveTask::values(std::vector<Reply> replies, Clock::time_point now) {
  auto answers = values_of(std::move(replies));
  if (!answers) return tl::unexpected(std::move(answers.error()));
  if (stage_ == Stage::kNewest) {
    OneInstant found = one_instant(*std::move(answers), std::nullopt);
    if (found.ask_again) {
      for (Part& part : plan_.parts) {
        std::get<LookupRequest>(part.request.body).query.at = found.ask_again;
      }
      stage_ = Stage::kInstant;
      return Next::kAsk;
    }
    answers = std::move(found.answers);
  }
  const auto path = observed_path(plan_, *answers);
  if (!path) return tl::unexpected(path.error());
  return observe(*path, now);
}

Result<Task::Next> ObserveTask::observe(const ObservedPath& path, Clock::time_point now) {
  const auto& missing = path.missing;
  const auto is_new = [&](const std::string& id) {
    return std::find(unknown_.begin(), unknown_.end(), id) == unknown_.end();
  };
  if (asks_for_frames_ && std::any_of(missing.begin(), missing.end(), is_new)) {
    unknown_ = missing;
    pause_ = Milliseconds(0);
    return Next::kPlan;
  }
  const auto exists = [&](const std::string& id) { return forest_.exists(id); };
  if (std::any_of(missing.begin(), missing.end(), exists)) {
    beside_.insert(beside_.end(), missing.begin(), missing.end());
    return again();
  }
  // Other owners will soon have what one owner has applied already, unless an edge was written
  // since.
  if (path.torn && torn_ < kTornAttempts && !limit_.over(now)) {
    pause_ = kTornPause * (1 << torn_++);
    return Next::kPlan;
  }
  const auto found =
      tfdude::observe(path.edges, measurement_.X_AB, source_ + "." + std::to_string(attempts_),
                      measurement_.options);
  if (found) return apply(path, *found);
  return fail_at("the path from " + quote(measurement_.a) + " to " + quote(measurement_.b),
                 found.error());
}

// One owner is asked before the others, the same for all observers of this path. Of two observers
// that have seen the same values, one is rejected there, and can retry before anything was applied.
Result<Task::Next> ObserveTask::apply(const ObservedPath& path, const Observation& found) {
  observed_ = {
      found.distance_squared, found.dimensions, found.limit, found.accepted, {}, path.stamp};
  for (std::size_t k = 0; k < plan_.edges.size(); ++k) {
    if (found.edges[k].corrected) observed_.corrected.push_back(plan_.edges[k].info.id);
  }
  shares_ = revisions(plan_, path, found);
  if (shares_.empty()) return Next::kDone;
  const auto first = std::min_element(
      shares_.begin(), shares_.end(),
      [](const Part& one, const Part& other) { return one.partition < other.partition; });
  std::iter_swap(shares_.begin(), first);
  later_.assign(std::make_move_iterator(shares_.begin() + 1),
                std::make_move_iterator(shares_.end()));
  shares_.resize(1);
  stage_ = Stage::kFirst;
  return Next::kAsk;
}

Result<Task::Next> ObserveTask::first(Reply reply) {
  auto* error = std::get_if<Error>(&reply.body);
  if (error != nullptr && error->code == Errc::kChangedMeanwhile) return again();
  if (error != nullptr) return tl::unexpected(std::move(*error));
  if (later_.empty()) return Next::kDone;
  shares_ = std::move(later_);
  stage_ = Stage::kOthers;
  return Next::kAsk;
}

Result<Task::Next> ObserveTask::others(const std::vector<Reply>& replies) {
  std::size_t done = 1;
  std::optional<Error> refused;
  for (const Reply& reply : replies) {
    const auto* error = std::get_if<Error>(&reply.body);
    if (error == nullptr) {
      ++done;
    } else if (!refused) {
      refused = *error;
    }
  }
  if (!refused) return Next::kDone;
  refused->message += "; " + std::to_string(done) + " of " + std::to_string(replies.size() + 1) +
                      " partitions have applied their part of the observation";
  return tl::unexpected(*std::move(refused));
}

Result<Task::Next> ObserveTask::again() {
  pause_ = Milliseconds(0);
  if (++attempts_ < kObserveAttempts) return Next::kPlan;
  return fail(Errc::kChangedMeanwhile, "edges between " + quote(measurement_.a) + " and " +
                                           quote(measurement_.b) +
                                           " were written each time that they were observed");
}

}  // namespace tfdude
