#include "calls/observe_task.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <utility>

#include "tfdude/base/id.hpp"

#include "calls/lookup_in_progress.hpp"
#include "math/observe_beside.hpp"
#include "partition/latest.hpp"
#include "partition/observed_instants.hpp"

namespace tfdude {
namespace {

// How often to repeat an observation if edges were written meanwhile, or were observed with still
// others. Of those who collide one succeeds each time, and the others wait a little longer each
// time, as they may be many.
constexpr int kObserveAttempts = 64;
constexpr int kAtOnce = 3;

// While another observation has not reached all owners, nothing is built on its part: it may be
// taken back, and can't be if there is something newer. One that was computed so long ago has
// reached them, or nobody will finish it. An edge that lacks it then was written since.
constexpr Milliseconds kTornFor{400};
// The same if such an edge was written before, as one that somebody updates again and again.
constexpr Milliseconds kTornForRewritten{30};
constexpr Milliseconds kLongestPause{32};

bool has(const std::vector<std::string>& all, const std::string& one) {
  return std::find(all.begin(), all.end(), one) != all.end();
}

// Before the next one of some attempts.
Milliseconds pause_before(int attempt) {
  return attempt < 1 ? Milliseconds(0)
                     : std::min(Milliseconds(1 << std::min(attempt - 1, 8)), kLongestPause);
}

// When an observation with that name was computed; absent: the name does not say it.
std::optional<Time> begin_of(const std::string& source) {
  std::int64_t ns = 0;
  const char* const from = source.c_str() + std::min(source.size(), kObservedPrefix.size());
  const char* const end = source.c_str() + source.size();
  const auto read = std::from_chars(from, end, ns);
  if (read.ec != std::errc() || read.ptr == end || *read.ptr != '.') return std::nullopt;
  return time_of(ns);
}

// The name of an observation that is computed so much later than the name says.
std::string later(const std::string& source, std::chrono::nanoseconds by) {
  const auto begin = begin_of(source);
  if (!begin) return source;
  return std::string(kObservedPrefix) + std::to_string(nanoseconds(*begin + by)) +
         source.substr(source.find('.', kObservedPrefix.size()));
}

// Whether a value differs by more than rounding, in units of its error.
bool has_changed(const Belief& before, const Belief& after) {
  constexpr double kRounding = 1e-9;
  const Transform X = collapse(before);
  const Transform Y = collapse(after);
  const Covariance::Upper& old = X.covariance.of_specified().upper();
  const Covariance::Upper& now = Y.covariance.of_specified().upper();
  const Twist moved = log(X.pose.inverse() * Y.pose);
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const double variance = old[upper_index(axis, axis)];
    if (std::abs(now[upper_index(axis, axis)] - variance) > kRounding * variance) return true;
    const double move = moved[static_cast<Eigen::Index>(axis)];
    if (move * move > kRounding * kRounding * variance) return true;
  }
  return before.unspecified != after.unspecified;
}

}  // namespace

ObserveTask::ObserveTask(const Forest& forest, Measurement measurement, std::string determined,
                         std::string source, EarlierObservations earlier, bool asks_for_frames,
                         const TimeLimit& limit)
    : forest_(forest),
      measurement_(std::move(measurement)),
      determined_(std::move(determined)),
      begin_(std::move(source)),
      earlier_(std::move(earlier)),
      asks_for_frames_(asks_for_frames),
      limit_(limit) {}

std::vector<std::string> ObserveTask::frames() const {
  std::vector<std::string> all{measurement_.a, measurement_.b};
  all.insert(all.end(), beside_.begin(), beside_.end());
  all.insert(all.end(), unknown_.begin(), unknown_.end());
  return all;
}

Result<void> ObserveTask::plan(const Directory& directory, Clock::time_point now) {
  if (!begun_) begun_ = now;
  stage_ = Stage::kNewest;
  const auto& [a, b, X_AB, stamp, options] = measurement_;
  std::vector<std::string> beside;
  std::copy_if(beside_.begin(), beside_.end(), std::back_inserter(beside),
               [&](const std::string& id) {
                 return std::count(left_out_.begin(), left_out_.end(), id) == 0;
               });
  auto planned = route_observe(forest_, directory, a, b, beside, stamp);
  if (!planned) return tl::unexpected(std::move(planned.error()));
  plan_ = *std::move(planned);
  for (std::size_t i = 0; i < plan_.path_parts; ++i) {
    std::get<LookupRequest>(plan_.parts[i].request.body).rows = Rows::kOfPath;
  }
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
      return others(replies);
    case Stage::kPresent:
      return present(std::move(replies));
    case Stage::kTakeBack:
      break;
  }
  return taken_back(replies);
}

bool ObserveTask::leave_out_silent(const std::vector<Reply>& replies) {
  bool any = false;
  for (std::size_t i = plan_.path_parts; i < replies.size(); ++i) {
    if (!std::holds_alternative<Error>(replies[i].body)) continue;
    for (std::string& id : plan_.beside(i)) left_out_.push_back(std::move(id));
    any = true;
  }
  return any;
}

// By the clocks of both observers. If they differ, it is waited for in vain, or not, and what it
// has not corrected yet stays as it is (observe_beside_others()).
bool ObserveTask::is_under_way(const std::string& source, Clock::time_point now) const {
  if (has(earlier_.settled, source)) return false;
  const auto own = begin_of(begin_);
  const auto other = begin_of(source);
  return !own || !other || (*own - *other) + (now - *begun_) < kTornFor;
}

// Other owners will soon have what one owner has applied already, unless an edge was written since.
bool ObserveTask::awaits_others(const ObservedPath& path, Clock::time_point now) {
  const auto& sources = path.lacking_sources;
  const bool any = std::any_of(sources.begin(), sources.end(),
                               [&](const std::string& one) { return is_under_way(one, now); });
  if (any && sources != awaited_) {
    awaited_ = sources;
    awaited_since_ = now;
    waits_ = 0;
  }
  const bool all_rewritten =
      std::all_of(path.lacking.begin(), path.lacking.end(),
                  [&](const std::string& id) { return has(earlier_.rewritten, id); });
  const bool waits = any && now - awaited_since_ < (all_rewritten ? kTornForRewritten : kTornFor);
  if (!waits && !sources.empty() && sources == awaited_) rewritten_ = path.lacking;
  return waits && !limit_.over(now);
}

// The values of all edges of the plan, at one instant.
Result<Task::Next> ObserveTask::values(std::vector<Reply> replies, Clock::time_point now) {
  pause_ = Milliseconds(0);
  if (leave_out_silent(replies)) return Next::kPlan;
  auto answers = values_of(std::move(replies));
  if (!answers) return tl::unexpected(std::move(answers.error()));
  if (stage_ == Stage::kNewest) {
    std::vector<SegmentValues> beside(
        std::make_move_iterator(answers->begin() + static_cast<std::ptrdiff_t>(plan_.path_parts)),
        std::make_move_iterator(answers->end()));
    answers->resize(plan_.path_parts);
    OneInstant found = one_instant(*std::move(answers), std::nullopt);
    found.answers.insert(found.answers.end(), std::make_move_iterator(beside.begin()),
                         std::make_move_iterator(beside.end()));
    if (found.ask_again) {
      for (std::size_t i = 0; i < plan_.path_parts; ++i) {
        std::get<LookupRequest>(plan_.parts[i].request.body).query.at = found.ask_again;
      }
      stage_ = Stage::kInstant;
      return Next::kAsk;
    }
    answers = std::move(found.answers);
  }
  auto path = observed_path(plan_, *answers);
  if (!path) return tl::unexpected(path.error());
  path_ = *std::move(path);
  return observe(path_, now);
}

Result<std::vector<ObservedEdge>> ObserveTask::edges_of(const ObservedPath& path) const {
  std::vector<ObservedEdge> edges = path.edges;
  if (determined_.empty()) return edges;
  for (std::size_t k = 0; k < plan_.edges.size(); ++k) {
    const bool is_beside = edges[k].way == ObservedEdge::Way::kBeside;
    if (is_beside || plan_.edges[k].info.id != determined_) continue;
    edges[k].X_PC.unspecified = true;
    return edges;
  }
  return fail(Errc::kInvalidInput, "no edge of the path from " + quote(measurement_.a) + " to " +
                                       quote(measurement_.b) + " is that of " + quote(determined_));
}

Result<Task::Next> ObserveTask::observe(const ObservedPath& path, Clock::time_point now) {
  std::vector<std::string> missing = path.missing;
  missing.erase(std::remove_if(missing.begin(), missing.end(),
                               [&](const std::string& id) {
                                 return std::count(left_out_.begin(), left_out_.end(), id) > 0 ||
                                        std::count(beside_.begin(), beside_.end(), id) > 0;
                               }),
                missing.end());
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
  if (awaits_others(path, now)) {
    pause_ = pause_before(++waits_);
    return Next::kPlan;
  }
  // What is left out may still be correlated with what is not, or will be in a moment.
  absent_.clear();
  std::copy_if(path.missing.begin(), path.missing.end(), std::back_inserter(absent_), exists);
  source_ = later(begin_, now - *begun_) + "." + std::to_string(attempts_);
  auto edges = edges_of(path);
  if (!edges) return tl::unexpected(std::move(edges.error()));
  if (measurement_.options.independent) {
    determine_forgotten(plan_, path, measurement_.X_AB, *edges);
  }
  loosen(plan_, *edges);
  ObservedInstants instants(plan_, path, source_);
  instants.name(*edges, !beside_others());
  auto found = (beside_others() ? observe_beside_others : tfdude::observe)(
      *edges, measurement_.X_AB, source_, measurement_.options);
  if (found) {
    instants.settle(*found);
    return apply(path, *found);
  }
  return fail_at("the path from " + quote(measurement_.a) + " to " + quote(measurement_.b),
                 found.error());
}

// One owner is asked before the others, the same for all observers of this path. Of two observers
// that have seen the same values, one is rejected there, and can retry before anything was applied.
Result<Task::Next> ObserveTask::apply(const ObservedPath& path, const Observation& found) {
  observed_ = {
      found.distance_squared, found.dimensions, found.limit, found.accepted, {}, {}, path.stamp};
  for (std::size_t k = 0; k < plan_.edges.size(); ++k) {
    const ObservedResult& edge = found.edges[k];
    const std::string& id = plan_.edges[k].info.id;
    if (edge.corrected && has_changed(path.edges[k].X_PC, edge.X_PC)) {
      observed_.corrected.push_back(id);
    }
    if (edge.forgotten) observed_.forgotten.push_back(id);
  }
  shares_ = revisions(plan_, path, found, absent_);
  owners_ = shares_.size();
  applied_.clear();
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
  applied_ = std::exchange(shares_, std::move(later_));
  stage_ = Stage::kOthers;
  return Next::kAsk;
}

Result<Task::Next> ObserveTask::others(const std::vector<Reply>& replies) {
  std::optional<Error> refused;
  for (std::size_t i = 0; i < replies.size(); ++i) {
    const auto* error = std::get_if<Error>(&replies[i].body);
    if (error == nullptr) {
      applied_.push_back(shares_[i]);
    } else if (!refused) {
      refused = *error;
    }
  }
  if (!refused) return Next::kDone;
  refused_ = *std::move(refused);
  shares_.clear();
  for (const Part& part : applied_) shares_.push_back(present_values(plan_, part));
  stage_ = Stage::kPresent;
  return Next::kAsk;
}

Result<Task::Next> ObserveTask::present(std::vector<Reply> replies) {
  shares_.clear();
  std::vector<Part> left;
  for (std::size_t i = 0; i < replies.size(); ++i) {
    const auto* values = std::get_if<SegmentValues>(&replies[i].body);
    auto back = values != nullptr ? tfdude::taken_back(plan_, path_, applied_[i], *values)
                                  : std::optional<Part>();
    if (back) {
      shares_.push_back(*std::move(back));
    } else {
      left.push_back(applied_[i]);
    }
  }
  applied_ = std::move(left);
  stage_ = Stage::kTakeBack;
  if (shares_.empty()) return taken_back({});
  return Next::kAsk;
}

Result<Task::Next> ObserveTask::taken_back(const std::vector<Reply>& replies) {
  for (std::size_t i = 0; i < replies.size(); ++i) {
    if (std::holds_alternative<Error>(replies[i].body)) applied_.push_back(shares_[i]);
  }
  if (applied_.empty() && refused_.code == Errc::kChangedMeanwhile) return again();
  refused_.message += "; " + std::to_string(applied_.size()) + " of " + std::to_string(owners_) +
                      " partitions have applied their part of the observation";
  return tl::unexpected(refused_);
}

Result<Task::Next> ObserveTask::again() {
  pause_ = pause_before(++attempts_ - kAtOnce);
  if (attempts_ < kObserveAttempts) return Next::kPlan;
  return fail(Errc::kChangedMeanwhile, "edges between " + quote(measurement_.a) + " and " +
                                           quote(measurement_.b) +
                                           " were written each time that they were observed");
}

}  // namespace tfdude
