#include "tree/former_edges.hpp"

#include <algorithm>
#include <iterator>
#include <string>
#include <unordered_map>
#include <unordered_set>

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

std::string what_of(const HeldVersion& edge, Time instant) {
  return "the edge of " + quote(edge.name->text) + ": what was believed at " + readable(instant);
}

Error about(const HeldVersion& edge, Errc code, std::string message) {
  Error error{code, std::move(message)};
  error.frame = edge.name->text;
  return error;
}

Error not_kept(const HeldVersion& edge, Time instant) {
  return about(
      edge, Errc::kTooOld,
      what_of(edge, instant) + " is not kept, as the setting `believed` of its history is 0");
}

Error not_kept_any_more(const HeldVersion& edge, Time instant, std::optional<std::int64_t> since) {
  return about(edge, Errc::kTooOld,
               what_of(edge, instant) + " is not kept: what was believed " +
                   (since ? "since " + readable(time_of(*since)) : std::string("now")) +
                   " can be asked for");
}

}  // namespace

Result<void> FormerEdges::take(const std::vector<Ends>& paths, const Query& query,
                               std::optional<Time> hint, const Past* past,
                               const Forest::Clock& clock) {
  for (const Ends& path : paths) copy(path);
  if (edges_.empty()) return {};
  const Time instant = *query.believed_at;
  const HeldVersion& first = *edges_.front().now;
  if (past == nullptr) return tl::unexpected(not_kept(first, instant));
  if (const auto now = clock ? clock() : std::nullopt; now && *now < instant) {
    return tl::unexpected(about(first, Errc::kNotYet,
                                what_of(first, instant) + " is not known yet: its owner's clock " +
                                    "is at " + readable(*now)));
  }
  const auto commit = past->commit_at(nanoseconds(instant));
  if (!commit) return tl::unexpected(not_kept_any_more(first, instant, past->known_since(0)));
  commit_ = *commit;
  for (Edge& edge : edges_) {
    if (auto ok = go_back(edge, *past, instant); !ok) return ok;
  }
  const auto asked = instants(query, hint);
  for (const Edge& edge : edges_) {
    if (edge.newest[0] != nullptr) take_samples(edge, asked);
  }
  return {};
}

// A path of its own for each, since a frame between two segments is the end of an edge in one.
void FormerEdges::copy(const Ends& path) {
  struct Node {
    Version* version;
    Head* head;
  };
  std::unordered_map<const Version*, Node> nodes;
  const auto node = [&](const Version& now) {
    const auto [found, is_new] = nodes.try_emplace(&now, Node{nullptr, nullptr});
    if (!is_new) return found->second;
    Version* version = now.held() ? &held_.emplace_back(static_cast<const HeldVersion&>(now))
                                  : &others_.emplace_back(now);
    found->second = {version, &heads_.emplace_back(version)};
    return found->second;
  };
  paths_.push_back({node(*path.a).version, node(*path.b).version, path.commit});
  const Version* a = path.a;
  const Version* b = path.b;
  while (a != b) {
    const Version*& here = a->depth >= b->depth ? a : b;
    if (here->above == nullptr) return;
    const Version* above = Frames::at(*here->above, path.commit);
    Version* then = node(*here).version;
    then->above = node(*above).head;
    if (here->held()) {
      edges_.push_back({static_cast<const HeldVersion*>(here), static_cast<HeldVersion*>(then)});
    }
    here = above;
  }
}

Result<void> FormerEdges::go_back(Edge& edge, const Past& past, Time instant) {
  const HeldVersion& now = *edge.now;
  if (now.commit <= commit_) return {};
  edge.past = past.find(now.slot);
  if (!past.keeps(now)) return tl::unexpected(not_kept(now, instant));
  const std::uint64_t since = edge.past != nullptr ? edge.past->since : now.commit;
  if (since > commit_) {
    return tl::unexpected(not_kept_any_more(now, instant, past.known_since(since)));
  }
  HeldVersion& then = *edge.then;
  const auto& states = edge.past->states;
  const auto state = std::upper_bound(
      states.begin(), states.end(), commit_,
      [](std::uint64_t commit, const FormerState& one) { return commit < one.until; });
  if (state != states.end()) {
    then.stamp = state->stamp;
    then.X_PC = state->X_PC;
    then.correlation = nullptr;
    if (!state->said.empty() || state->now) {
      correlations_.push_back(state->now
                                  ? make_in<EdgeCorrelation>(arena_, state->said, *state->now)
                                  : make_in<EdgeCorrelation>(arena_, state->said));
      then.correlation = correlations_.back().get();
    }
  }
  if (!then.moving() || then.lacks_sample()) return {};
  find_newest(edge);
  if (edge.newest[0] != nullptr) return {};
  return tl::unexpected(not_kept_any_more(now, instant, past.known_since(now.commit)));
}

template <class Visit>
void FormerEdges::for_each_sample(const Edge& edge, Visit visit) const {
  const auto& former = edge.past->samples;
  auto one = std::upper_bound(
      former.begin(), former.end(), commit_,
      [](std::uint64_t commit, const FormerSample& sample) { return commit < sample.until; });
  // A correction may keep the commit of what it replaces (Forest::Impl::Telling): of one stamp,
  // what was replaced first was there.
  std::unordered_set<std::int64_t> there;
  for (; one != former.end(); ++one) {
    if (one->sample.commit > commit_ || !there.insert(one->sample.stamp).second) continue;
    visit(one->sample);
  }
  const HeldVersion& now = *edge.now;
  if (!now.moving() || now.lacks_sample()) return;
  for (std::uint64_t number = now.samples->oldest(); number <= now.number; ++number) {
    const Sample* sample = now.samples->sample(number);
    if (sample == nullptr || sample->commit > commit_ || there.count(sample->stamp) != 0) continue;
    visit(*sample);
  }
}

void FormerEdges::find_newest(Edge& edge) const {
  for_each_sample(edge, [&](const Sample& sample) {
    auto& [first, second] = edge.newest;
    if (first == nullptr || sample.stamp > first->stamp) {
      second = first;
      first = &sample;
    } else if (second == nullptr || sample.stamp > second->stamp) {
      second = &sample;
    }
  });
  if (edge.newest[0] != nullptr) edge.then->stamp = edge.newest[0]->stamp;
}

// Those that a lookup may need: what it asks for, or else the latest common time.
std::vector<std::int64_t> FormerEdges::instants(const Query& query,
                                                std::optional<Time> hint) const {
  std::vector<std::int64_t> all;
  if (query.at) all.push_back(nanoseconds(*query.at));
  if (hint) all.push_back(nanoseconds(*hint));
  if (query.at) return all;
  std::int64_t common = INT64_MAX;
  for (const Edge& edge : edges_) {
    if (edge.then->limits()) common = std::min(common, edge.then->stamp);
  }
  all.push_back(common);
  return all;
}

void FormerEdges::take_samples(const Edge& edge, const std::vector<std::int64_t>& instants) {
  std::vector<const Sample*> taken{edge.newest[0]};
  if (edge.newest[1] != nullptr) taken.push_back(edge.newest[1]);
  std::vector<SampleHistory::Bracket> around(instants.size());
  for_each_sample(edge, [&](const Sample& sample) {
    for (std::size_t i = 0; i < instants.size(); ++i) {
      auto& [before, after] = around[i];
      const bool is_before = sample.stamp <= instants[i];
      const Sample*& nearest = is_before ? before : after;
      if (nearest == nullptr || (sample.stamp > nearest->stamp) == is_before) nearest = &sample;
    }
  });
  for (const auto& [before, after] : around) {
    if (before != nullptr) taken.push_back(before);
    if (after != nullptr) taken.push_back(after);
  }
  const auto earlier = [](const Sample* a, const Sample* b) { return a->stamp < b->stamp; };
  std::sort(taken.begin(), taken.end(), earlier);
  taken.erase(std::unique(taken.begin(), taken.end()), taken.end());
  HeldVersion& then = *edge.then;
  histories_.push_back(SampleHistory::create(arena_, edge.now->samples->timing()));
  SampleHistory& history = *histories_.back();
  // At most two for each of two instants, and the newest two, which is less than it has room for.
  for (const Sample* sample : taken) history.append(*sample, store_);
  then.samples = &history;
  then.number = history.next() - 1;
  const auto& made_up = edge.past->made_up;
  const auto later = std::upper_bound(
      made_up.begin(), made_up.end(), commit_,
      [](std::uint64_t commit, const FormerMadeUp& one) { return commit < one.since; });
  const std::int64_t last = later == made_up.begin() ? kAlways : std::prev(later)->stamp;
  for (std::uint64_t number = history.oldest(); number <= then.number; ++number) {
    if (history.stamp(number) <= last) history.set_made_up(number);
  }
  const Sample& newest = *edge.newest[0];
  const bool is_that_of_now = edge.now->moving() && edge.now->stamp == newest.stamp &&
                              edge.now->samples->sample(edge.now->number)->commit == newest.commit;
  then.X_PC = is_that_of_now ? edge.now->X_PC : newest.value();
}

}  // namespace tfdude
