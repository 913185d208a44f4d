#include "calls/lookup_many_task.hpp"

#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"

#include "partition/assembly.hpp"

namespace tfdude {
namespace {

// Into how many requests one is divided that has an error.
constexpr std::size_t kPieces = 8;
// How often a reply that the plan is outdated makes another plan.
constexpr int kMostRefusals = 2;

bool is_of_data(Errc code) {
  return code == Errc::kNotYet || code == Errc::kTooOld || code == Errc::kInvalidInput ||
         code == Errc::kNotOwner;
}

}  // namespace

LookupManyTask::LookupManyTask(const Forest& forest, ClockKind own, SharedHints& hints,
                               std::vector<FramePair> pairs, const Query& query)
    : forest_(forest),
      own_(own),
      hints_(hints),
      pairs_(std::move(pairs)),
      query_(query),
      planned_(pairs_.size()),
      found_(pairs_.size(), tl::unexpected(Error{Errc::kTimeout, "not asked"})) {
  for (const FramePair& pair : pairs_) key_ += pair.a + '\n' + pair.b + '\n';
}

std::vector<std::string> LookupManyTask::frames() const {
  std::vector<std::string> ids;
  for (const FramePair& pair : pairs_) {
    ids.push_back(pair.a);
    ids.push_back(pair.b);
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

Result<void> LookupManyTask::plan(const Directory& directory, Clock::time_point now) {
  restart();
  at_ = query_.at && *query_.at < Time{} ? Time{} : query_.at;
  // Hints are for what is known now.
  const bool guesses = !query_.at && !query_.believed_at;
  hint_ = guesses ? hints_.guess(key_, {}, now) : std::nullopt;
  planned_at_ = now;
  Result<void> outcome;
  differs_.clear();
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    Pair& pair = planned_[i];
    if (pair.settled) continue;
    pair = {};
    auto planned = route_lookup(forest_, directory, pairs_[i].a, pairs_[i].b, query_, hint_);
    if (!planned) {
      pair.error = std::move(planned.error());
      if (outcome && may_appear(pair.error->code)) outcome = tl::unexpected(*pair.error);
      continue;
    }
    if (differs_.empty()) differs_ = other_clock(directory, own_, planned->parts);
    pair.plan = *std::move(planned);
    add_segments(i);
  }
  if (!outcome) return outcome;
  if (query_.age_noise_until && !differs_.empty()) {
    return fail(Errc::kInvalidInput,
                "no process noise can be added until another instant: " + differs_);
  }
  ask();
  return {};
}

void LookupManyTask::restart() {
  ends_.clear();
  segments_.clear();
  known_.clear();
  groups_.clear();
  asked_.clear();
  too_old_.clear();
}

// Pairs share the segments that they have in common. At a negative instant the answer says of all
// segments together whether one is dynamic, so there each pair has its own.
void LookupManyTask::add_segments(std::size_t i) {
  Pair& pair = planned_[i];
  for (const Part& part : pair.plan->parts) {
    for (const PathEnds& ends : std::get<LookupRequest>(part.request.body).segments) {
      const std::size_t apart = pair.plan->before_all ? i + 1 : 0;
      const auto [known, is_new] =
          known_.try_emplace({part.owner, ends.from, ends.to, apart}, segments_.size());
      pair.segments.push_back(known->second);
      if (!is_new) continue;
      segments_.push_back({});
      ends_.push_back(ends);
      const auto open = std::find_if(asked_.begin(), asked_.end(), [&](const Group& group) {
        return group.owner == part.owner && group.segments.size() < kMaxItems && apart == 0;
      });
      const bool found = open != asked_.end();
      Group& group = found ? *open : asked_.emplace_back();
      if (!found) {
        group.owner = part.owner;
        group.partition = part.partition;
        group.id = part.request.id;
      }
      group.segments.push_back(known->second);
    }
  }
}

// Makes the requests of the groups that are asked.
void LookupManyTask::ask() {
  parts_.clear();
  for (const Group& group : asked_) {
    LookupRequest body;
    for (const std::size_t segment : group.segments) body.segments.push_back(ends_[segment]);
    body.query = query_;
    body.query.at = at_;
    // Of an instant that was not asked for, the hint says that it is the latest common time.
    body.hint = query_.at ? std::nullopt : at_ ? at_ : hint_;
    parts_.push_back({group.owner, group.partition, Request{0, group.id, std::move(body)}});
  }
}

void LookupManyTask::divide(Group group) {
  const std::size_t each = (group.segments.size() + kPieces - 1) / kPieces;
  for (std::size_t first = 0; first < group.segments.size(); first += each) {
    Group& piece = asked_.emplace_back(Group{group.owner, group.partition, group.id, {}, {}});
    const auto begin = group.segments.begin() + static_cast<std::ptrdiff_t>(first);
    piece.segments.assign(
        begin, begin + static_cast<std::ptrdiff_t>(std::min(each, group.segments.size() - first)));
  }
}

Result<void> LookupManyTask::take_reply(Group group, Reply reply) {
  if (auto* values = std::get_if<SegmentValues>(&reply.body)) {
    if (values->values.size() != group.segments.size()) {
      reply.body =
          Error{Errc::kNotOwner, "partition " + quote(group.partition) + " gave " +
                                     std::to_string(values->values.size()) + " transforms for " +
                                     std::to_string(group.segments.size()) + " segments"};
    } else {
      for (std::size_t k = 0; k < group.segments.size(); ++k) {
        segments_[group.segments[k]] = {std::nullopt, groups_.size(), k};
      }
      group.answer = std::move(*values);
      groups_.push_back(std::move(group));
      return {};
    }
  }
  Error* error = std::get_if<Error>(&reply.body);
  const Error other{Errc::kNotOwner,
                    "partition " + quote(group.partition) + " answered something else"};
  const Error& why = error != nullptr ? *error : other;
  if (is_of_data(why.code) && group.segments.size() > 1) {
    divide(std::move(group));
    return {};
  }
  if (why.code == Errc::kNotOwner && refusals_ < kMostRefusals) {
    ++refusals_;
    return tl::unexpected(why);
  }
  for (const std::size_t segment : group.segments) segments_[segment].error = why;
  if (why.code == Errc::kTooOld && at_ && !query_.at) too_old_.push_back(std::move(group));
  return {};
}

Result<Task::Next> LookupManyTask::take(std::vector<Reply> replies, Clock::time_point now) {
  std::vector<Group> asked = std::exchange(asked_, {});
  for (std::size_t i = 0; i < asked.size(); ++i) {
    auto taken = take_reply(std::move(asked[i]), std::move(replies[i]));
    if (!taken) return tl::unexpected(std::move(taken.error()));
  }
  if (asked_.empty()) {
    const bool newest = !query_.at && !at_;
    if (newest) note_errors();
    const bool again =
        newest ? drop_failed() || again_at_one_instant(now) : again_without_slowest();
    if (!again) {
      note_errors();
      finish();
      return Next::kDone;
    }
  }
  ask();
  return Next::kAsk;
}

void LookupManyTask::note_errors() {
  for (Pair& pair : planned_) {
    if (!pair.plan || pair.error) continue;
    for (const std::size_t segment : pair.segments) {
      if (!segments_[segment].error) continue;
      pair.error = segments_[segment].error;
      break;
    }
  }
}

// Segments of pairs that have failed, and of no other, must not determine the instant: if an answer
// has some, the others are asked for again.
bool LookupManyTask::drop_failed() {
  std::vector<bool> needed(segments_.size(), false);
  for (const Pair& pair : planned_) {
    if (!pair.plan || pair.error) continue;
    for (const std::size_t segment : pair.segments) needed[segment] = true;
  }
  std::vector<Group> kept;
  for (Group& group : groups_) {
    const auto unneeded = [&](std::size_t segment) { return !needed[segment]; };
    auto& all = group.segments;
    if (std::none_of(all.begin(), all.end(), unneeded)) {
      kept.push_back(std::move(group));
      continue;
    }
    all.erase(std::remove_if(all.begin(), all.end(), unneeded), all.end());
    group.answer.reset();
    if (!all.empty()) asked_.push_back(std::move(group));
  }
  groups_ = std::move(kept);
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    for (const std::size_t segment : groups_[i].segments) segments_[segment].group = i;
  }
  return !asked_.empty();
}

// @return whether owners are asked again, for the latest common time
bool LookupManyTask::again_at_one_instant(Clock::time_point now) {
  if (groups_.size() < 2) return false;
  std::vector<SegmentValues> answers;
  answers.reserve(groups_.size());
  for (const Group& group : groups_) answers.push_back(*group.answer);
  if (!query_.believed_at) hints_.note(key_, {}, planned_at_, now, answers);
  OneInstant found = one_instant(std::move(answers), hint_);
  if (!found.ask_again) {
    for (std::size_t i = 0; i < groups_.size(); ++i) {
      groups_[i].answer = std::move(found.answers[i]);
    }
    return false;
  }
  at_ = found.ask_again;
  std::vector<Group> groups = std::exchange(groups_, {});
  for (Group& group : groups) {
    const auto& stamp = group.answer->stamp;
    group.slowest = stamp && stamp == at_;
    std::vector<Group>& to = stamp && stamp != at_ ? asked_ : groups_;
    for (const std::size_t segment : group.segments) segments_[segment].group = groups_.size();
    to.push_back(std::move(group));
  }
  return true;
}

// If some have no data at the latest common time, those that determine it are the ones without an
// answer: one edge that nobody updates any more is not to keep all others from theirs. They are
// asked for in smaller groups first, to find the edge.
bool LookupManyTask::again_without_slowest() {
  if (too_old_.empty()) return false;
  const std::vector<Group> groups = std::exchange(groups_, {});
  const bool divides = std::any_of(groups.begin(), groups.end(), [](const Group& group) {
    return group.slowest && group.segments.size() > 1;
  });
  for (const Group& group : groups) {
    Group again{group.owner, group.partition, group.id, group.segments, {}};
    if (!group.slowest || (divides && group.segments.size() == 1)) {
      asked_.push_back(std::move(again));
    } else if (divides) {
      divide(std::move(again));
    } else {
      segments_[group.segments.front()].error =
          Error{Errc::kTooOld, "there is no latest common time: the newest of partition " +
                                   quote(group.partition) + " is " + readable(*at_) +
                                   ", when others have no data"};
    }
  }
  for (Group& group : std::exchange(too_old_, {})) {
    for (const std::size_t segment : group.segments) segments_[segment].error.reset();
    asked_.push_back(std::move(group));
  }
  at_.reset();
  hint_.reset();
  return true;
}

LookupManyTask::Found LookupManyTask::assembled(const Pair& pair) const {
  std::vector<SegmentValues> answers;
  std::size_t next = 0;
  for (const Part& part : pair.plan->parts) {
    SegmentValues& answer = answers.emplace_back();
    bool correlated = false;
    const std::size_t count = std::get<LookupRequest>(part.request.body).segments.size();
    for (std::size_t k = 0; k < count; ++k) {
      const Segment& segment = segments_[pair.segments[next++]];
      const SegmentValues& from = *groups_[segment.group].answer;
      answer.stamp = from.stamp;
      answer.values.push_back(from.values[segment.place]);
      const bool has = segment.place < from.correlations.size();
      answer.correlations.push_back(has ? from.correlations[segment.place] : PathCorrelation());
      correlated = correlated || !answer.correlations.back().empty();
      for (const UnspecifiedEdge& edge : from.unspecified) {
        if (edge.segment == segment.place) answer.unspecified.push_back({k, edge.id});
      }
    }
    if (!correlated) answer.correlations.clear();
  }
  return assemble(*pair.plan, answers);
}

void LookupManyTask::finish() {
  // All answers have the stamp of the instant, whether a dynamic edge is on their path or not.
  std::optional<Time> stamp;
  for (const Group& group : groups_) {
    if (group.answer->stamp) stamp = group.answer->stamp;
  }
  for (std::size_t i = 0; i < planned_.size(); ++i) {
    const Pair& pair = planned_[i];
    Found found = pair.error ? Found(tl::unexpected(*pair.error)) : assembled(pair);
    if (found && !pair.plan->before_all) found->stamp = stamp;
    if (!found && !differs_.empty() &&
        (found.error().code == Errc::kTooOld || found.error().code == Errc::kNotYet)) {
      found.error().message += "; " + differs_;
    }
    found_[i] = std::move(found);
  }
}

bool LookupManyTask::settle(const Error& last) {
  bool any = false;
  for (Pair& pair : planned_) {
    if (pair.settled || !pair.error || !may_appear(pair.error->code)) continue;
    pair.settled = any = true;
    // What is not certain is a timeout; others keep what they have found out themselves.
    if (last.code == Errc::kTimeout) pair.error = last;
  }
  return any;
}

void LookupManyTask::fail_all(const Error& error) {
  for (std::size_t i = 0; i < planned_.size(); ++i) {
    found_[i] = tl::unexpected(planned_[i].error ? *planned_[i].error : error);
  }
}

}  // namespace tfdude
