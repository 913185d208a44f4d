#include "runtime/watch_mirror.hpp"

#include <algorithm>
#include <utility>

namespace tfdude {
namespace {

bool is_same_process(const WatchRoute::Source& a, const WatchRoute::Source& b) {
  return a.partition == b.partition && a.incarnation == b.incarnation;
}

Result<WatchRoute> route_of(Result<WatchPlan> plan, const Directory& directory,
                            std::uint64_t own_incarnation) {
  if (!plan) return tl::unexpected(std::move(plan.error()));
  WatchRoute route{std::move(plan->edges), {}, std::move(plan->parts)};
  for (const Part& part : route.parts) {
    const auto& request = std::get<WatchRequest>(part.request.body);
    const auto serving = directory.serving(part.partition);
    const std::uint64_t incarnation = part.owner == kHeldHere ? own_incarnation
                                      : serving               ? serving->incarnation
                                                              : 0;
    WatchRoute::Source source{
        part.partition, incarnation, watch_group(part.partition, incarnation, request), {}};
    for (const PathEnds& segment : request.segments) source.frames.push_back(segment.to);
    route.sources.push_back(std::move(source));
  }
  return route;
}

}  // namespace

bool WatchRoute::is_same(const WatchRoute& other) const {
  const auto same_edge = [](const FrameInfo& a, const FrameInfo& b) {
    return a.id == b.id && a.parent == b.parent;
  };
  const auto same_source = [](const Source& a, const Source& b) { return a.group == b.group; };
  return std::equal(edges.begin(), edges.end(), other.edges.begin(), other.edges.end(),
                    same_edge) &&
         std::equal(sources.begin(), sources.end(), other.sources.begin(), other.sources.end(),
                    same_source);
}

Result<WatchRoute> watch_route(const Forest& forest, const Directory& directory,
                               const std::string& a, const std::string& b, bool composed,
                               std::chrono::nanoseconds period, std::uint64_t own_incarnation) {
  return route_of(route_watch(forest, directory, a, b, composed, period), directory,
                  own_incarnation);
}

Result<WatchRoute> watch_route(const Forest& forest, const Directory& directory,
                               const std::vector<std::string>& ids, std::chrono::nanoseconds period,
                               std::uint64_t own_incarnation) {
  return route_of(route_watch_edges(forest, directory, ids, period), directory, own_incarnation);
}

WatchMirror::WatchMirror(const std::string& a, const std::string& b, WatchRoute route,
                         const EdgeTiming& timing)
    : route_(std::move(route)), edges_(route_.edges.size()) {
  // The owner judges a source's clock.
  EdgeTiming told = timing;
  told.restart_after = 0;
  told.believed = std::chrono::nanoseconds(0);
  told.max_ahead = std::chrono::nanoseconds::max();
  (void)forest_.set_default_timing(told);
  constexpr auto kAllow = Forest::MissingParent::kAllow;
  for (const FrameInfo& edge : route_.edges) {
    (void)forest_.add(edge.id, edge.parent, Transform(), kAllow);
  }
  // A parent that is not the child of another edge is the root of the path.
  for (const FrameInfo& edge : route_.edges) {
    if (!forest_.exists(edge.parent)) (void)forest_.add(edge.parent, "", Transform());
  }
  if (!forest_.exists(a)) (void)forest_.add(a, "", Transform());
  a_ = forest_.find(a).value_or(Handle());
  b_ = forest_.find(b).value_or(Handle());
  for (const FrameInfo& edge : route_.edges) {
    handles_.push_back(forest_.find(edge.id).value_or(Handle()));
  }
  for (const WatchRoute::Source& source : route_.sources) {
    sources_.push_back({{}, ReceivedGroup(source.frames.size())});
    for (const std::string& frame : source.frames) {
      const auto edge = std::find_if(route_.edges.begin(), route_.edges.end(),
                                     [&](const FrameInfo& one) { return one.id == frame; });
      const auto index = static_cast<std::size_t>(edge - route_.edges.begin());
      sources_.back().edges.push_back(static_cast<std::uint32_t>(index));
      if (edge != route_.edges.end()) edges_[index].source = sources_.size() - 1;
    }
  }
}

void WatchMirror::inherit(const WatchMirror& before) {
  std::vector<PushedValue> values;
  for (std::uint32_t i = 0; i < edges_.size(); ++i) {
    const FrameInfo& own = route_.edges[i];
    const auto known = std::find_if(
        before.route_.edges.begin(), before.route_.edges.end(),
        [&](const FrameInfo& edge) { return edge.id == own.id && edge.parent == own.parent; });
    if (known == before.route_.edges.end()) continue;
    const Edge& edge = before.edges_[static_cast<std::size_t>(known - before.route_.edges.begin())];
    if (edge.history == 0 ||
        !is_same_process(before.route_.sources[edge.source], route_.sources[edges_[i].source])) {
      continue;
    }
    std::vector<EdgeCursor> nothing{{own.id, own.parent}};
    for (PushedValue& value :
         before.forest_.values_since(nothing, {false, time_of(0), false, true}).values) {
      value.index = i;
      values.push_back(std::move(value));
    }
    edges_[i].history = edge.history;
    edges_[i].commit = edge.commit;
    edges_[i].answered = edge.answered;
    edges_[i].answered_from = edge.answered_from;
    edges_[i].said = edge.said;
    edges_[i].newest = edge.newest;
    edges_[i].complete = edge.complete;
  }
  forest_.take(handles_, values);
  if (const auto from = before.skipped_from()) skipped_.add(*from);
}

std::vector<Time> WatchMirror::stamps(std::string_view id, Time after) const {
  std::vector<Time> stamps;
  const auto edge = std::find_if(route_.edges.begin(), route_.edges.end(),
                                 [&](const FrameInfo& one) { return one.id == id; });
  if (edge == route_.edges.end()) return stamps;
  std::vector<EdgeCursor> nothing{{edge->id, edge->parent}};
  for (const PushedValue& value : forest_.values_since(nothing, {false, after}).values) {
    if (value.stamp && *value.stamp > after) stamps.push_back(*value.stamp);
  }
  std::sort(stamps.begin(), stamps.end());
  return stamps;
}

void WatchMirror::admit(const Source& source, PushedValue entry, const Message& message,
                        Admitted& admitted) {
  if (entry.index >= source.edges.size()) return;
  entry.index = source.edges[entry.index];
  if (entry.index >= edges_.size()) return;
  Edge& edge = edges_[entry.index];
  const bool begins = entry.history > edge.history;
  if (entry.history < edge.history || (begins && !entry.process_noise)) return;
  // A sample gives the edge's value at its stamp. But a value without a stamp may be half of a
  // commit.
  if (!message.follows_on && !entry.stamp && !entry.cleared) return;
  const bool is_told =
      message.commit <= edge.commit ||
      (message.commit <= edge.answered && (!entry.stamp || *entry.stamp >= edge.answered_from));
  const bool is_stale = !begins && is_told;
  // Only the last value in a message has what is said of the edge.
  if (!is_of_sample(entry)) {
    const bool is_old = !begins && message.commit <= std::max(edge.commit, edge.answered);
    if (is_old) entry.correlation = edge.said;
    edge.said = entry.correlation;
  }
  if (is_stale && (!entry.stamp || entry.cleared)) return;
  if (!begins) entry.process_noise.reset();
  if (!begins || entry.continues != edge.history) entry.kept_before.reset();
  // The stamps of another history say nothing about this one: a source's clock may jump back.
  if (begins || entry.cleared) {
    edge.newest.reset();
    edge.complete.reset();
  }
  edge.history = entry.history;
  if (entry.stamp && (!edge.newest || *entry.stamp > *edge.newest)) edge.newest = entry.stamp;
  (is_stale ? admitted.missed : admitted.values).push_back(std::move(entry));
}

void WatchMirror::note_skipped(const Source& source, const PushedValues& answer) {
  for (const PushedValue* first : first_samples(answer, source.edges.size())) {
    const std::uint32_t index = source.edges[first->index];
    if (index >= edges_.size() || edges_[index].history == 0) continue;
    const Edge& edge = edges_[index];
    const bool begins = first->history > edge.history;
    const Time known = begins ? Time() : edge.complete.value_or(Time());
    if (*first->stamp > known) skipped_.add(known);
  }
}

void WatchMirror::note_told(const PushedValues& message, bool follows_on,
                            const std::vector<PushedValue>& values) {
  for (const PushedValue& value : values) {
    Edge& edge = edges_[value.index];
    if (!is_answer(message)) {
      // If something is missing, the same commit may be told again, with more.
      const std::uint64_t more = follows_on || message.commit == 0 ? 0 : 1;
      edge.commit = std::max(edge.commit, message.commit - more);
    } else if (message.commit > edge.answered) {
      edge.answered = message.commit;
      edge.answered_from = value.stamp.value_or(Time::min());
    } else if (message.commit == edge.answered && value.stamp) {
      edge.answered_from = std::min(edge.answered_from, *value.stamp);
    }
  }
}

bool WatchMirror::has(std::uint64_t group) const {
  return std::any_of(route_.sources.begin(), route_.sources.end(),
                     [&](const WatchRoute::Source& source) { return source.group == group; });
}

bool WatchMirror::take(const PushedValues& pushed) {
  const auto told =
      std::find_if(route_.sources.begin(), route_.sources.end(),
                   [&](const WatchRoute::Source& source) { return source.group == pushed.group; });
  if (told == route_.sources.end()) return false;
  Source& source = sources_[static_cast<std::size_t>(told - route_.sources.begin())];
  auto whole = source.received.whole(pushed);
  if (!whole) return false;
  // A complete commit that does not follow on may lack samples between those reported.
  const auto [is_old, in_order] = source.received.place(*whole);
  const bool follows_on = in_order && !is_old;
  // Before the first complete values there is nothing that a sample could belong to.
  if (!source.received.answered()) return false;
  if (whole->after == 0 && !is_old) note_skipped(source, *whole);
  Admitted admitted;
  for (PushedValue& entry : whole->entries) {
    admit(source, std::move(entry), {whole->commit, follows_on}, admitted);
  }
  note_told(*whole, follows_on, admitted.values);
  if (!source.received.lacks()) {
    for (const std::uint32_t index : source.edges) {
      if (index < edges_.size()) edges_[index].complete = edges_[index].newest;
    }
  }
  if (!admitted.missed.empty()) forest_.take(handles_, admitted.missed, false);
  forest_.take(handles_, admitted.values);
  return !is_old;
}

bool WatchMirror::complete() const {
  return std::all_of(sources_.begin(), sources_.end(),
                     [](const Source& source) { return source.received.answered(); });
}

bool WatchMirror::lacks() const {
  return std::any_of(sources_.begin(), sources_.end(),
                     [](const Source& source) { return source.received.lacks(); });
}

bool WatchMirror::is_behind(const WatchMirror& other) const {
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    const Source* like = other.source_like(route_.sources[i]);
    if (like != nullptr && sources_[i].received.is_behind(like->received)) return true;
  }
  return false;
}

const WatchMirror::Source* WatchMirror::source_like(const WatchRoute::Source& source) const {
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    if (is_same_process(route_.sources[i], source)) return &sources_[i];
  }
  return nullptr;
}

std::optional<Time> WatchMirror::lacks_history() const {
  const auto newest = lookup({});
  if (newest || newest.error().code != Errc::kTooOld) return std::nullopt;
  std::optional<Time> common;
  for (const Edge& edge : edges_) {
    if (edge.newest && (!common || *edge.newest < *common)) common = edge.newest;
  }
  return common;
}

}  // namespace tfdude
