#include "tree/past.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace tfdude {
namespace {

std::size_t bytes_of(const Correlation& correlation) {
  std::size_t bytes = 0;
  for (const CommonError& one : correlation.common_errors) {
    bytes += sizeof(one) + one.source.size() +
             static_cast<std::size_t>(one.loading.size()) * sizeof(double);
  }
  return bytes;
}

std::size_t bytes_of(const FormerState& state) {
  return sizeof(state) + bytes_of(state.said) + (state.now ? bytes_of(*state.now) : 0);
}

FormerState state_of(const HeldVersion& edge, std::uint64_t until) {
  FormerState state{until, edge.stamp, edge.X_PC};
  if (edge.correlation == nullptr) return state;
  state.said = edge.correlation->said();
  if (edge.correlation->revised()) state.now = edge.correlation->now();
  return state;
}

bool is_sampled(const HeldVersion& edge) { return edge.moving() && !edge.lacks_sample(); }

std::int64_t made_up_stamp(const HeldVersion& edge) {
  const std::uint64_t end = is_sampled(edge) ? edge.samples->made_up_end() : 0;
  return end > 0 ? edge.samples->stamp(end - 1) : kAlways;
}

}  // namespace

void Past::keep_for(std::chrono::nanoseconds believed) {
  longest_ = std::max(longest_, believed);
  if (times_.empty()) note_time(frames_.snapshot());
}

// The newest version of an earlier commit.
const Version* Past::before(std::uint32_t slot) const {
  const Version* version = &frames_.newest(slot);
  while (version != nullptr && version->commit == frames_.commit_being_made()) {
    version = version->older;
  }
  return version;
}

EdgePast* Past::of(std::uint32_t slot) {
  if (slot >= edges_.size()) edges_.resize(slot + 1);
  if (edges_[slot] != nullptr) return edges_[slot].get();
  const Version* old = before(slot);
  if (old == nullptr || !old->held()) return nullptr;
  const auto& edge = static_cast<const HeldVersion&>(*old);
  if (!keeps(edge)) return nullptr;
  edges_[slot] = std::make_unique<EdgePast>();
  // Since then it is what it is now.
  edges_[slot]->since = edge.commit;
  edges_[slot]->made_up.push_back({edge.commit, made_up_stamp(edge)});
  store_.add(sizeof(FormerMadeUp));
  return edges_[slot].get();
}

void Past::bury(std::uint32_t slot, const SampleHistory& samples,
                const SampleHistory::Range& dropped) {
  EdgePast* edge = of(slot);
  if (edge == nullptr) return;
  const std::uint64_t until = frames_.commit_being_made();
  for (std::uint64_t number = dropped.first; number < dropped.end; ++number) {
    const Sample* sample = samples.sample(number);
    // What this commit has added itself, nobody has seen.
    if (sample == nullptr || sample->commit == until) continue;
    store_.keep(sample->shared);
    store_.add(sizeof(FormerSample));
    edge->samples.push_back({*sample, until});
  }
}

void Past::release(const FormerSample& one) {
  store_.release(one.sample.shared);
  store_.subtract(sizeof(FormerSample));
}

void Past::forget(std::uint32_t slot) {
  if (find(slot) == nullptr) return;
  EdgePast& edge = *edges_[slot];
  for (const FormerSample& one : edge.samples) release(one);
  for (const FormerState& one : edge.states) store_.subtract(bytes_of(one));
  store_.subtract(edge.made_up.size() * sizeof(FormerMadeUp));
  edges_[slot] = nullptr;
}

void Past::forget_before(std::uint32_t slot) {
  forget(slot);
  if (EdgePast* edge = of(slot)) edge->since = frames_.commit_being_made();
}

void Past::commit(const std::vector<HeldVersion*>& superseded) {
  const std::uint64_t commit = frames_.commit_being_made();
  note_time(commit);
  for (auto one = superseded.rbegin(); one != superseded.rend(); ++one) {
    if (frames_.newest((*one)->slot).commit != commit) break;
    note((*one)->slot);
  }
  // An edge that does not change any more is also pruned.
  if (edges_.empty()) return;
  next_pruned_ = (next_pruned_ + 1) % edges_.size();
  if (edges_[next_pruned_] != nullptr) prune(*edges_[next_pruned_]);
}

void Past::note(std::uint32_t slot) {
  const Version& fresh = frames_.newest(slot);
  const Version* old = before(slot);
  const bool same = old != nullptr && old->held() && fresh.held() &&
                    old->generation == fresh.generation && old->attachment == fresh.attachment;
  if (!same || !keeps(static_cast<const HeldVersion&>(fresh))) return forget(slot);
  EdgePast* edge = of(slot);
  if (edge == nullptr) return;
  const auto& was = static_cast<const HeldVersion&>(*old);
  const auto& is = static_cast<const HeldVersion&>(fresh);
  const std::uint64_t commit = frames_.commit_being_made();
  const bool noted = !edge->states.empty() && edge->states.back().until == commit;
  // Samples alone tell their values.
  const bool only_samples = is_sampled(was) && is_sampled(is) && was.correlation == is.correlation;
  if (!noted && !only_samples) {
    edge->states.push_back(state_of(was, commit));
    store_.add(bytes_of(edge->states.back()));
  }
  if (const std::int64_t stamp = made_up_stamp(is); stamp != edge->made_up.back().stamp) {
    edge->made_up.push_back({commit, stamp});
    store_.add(sizeof(FormerMadeUp));
  }
  prune(*edge);
}

// If the clock was set back, it would show the same time twice: what was kept until then is not.
void Past::note_time(std::uint64_t commit) {
  const auto now = clock_ ? clock_() : std::nullopt;
  if (!now) return;
  const std::int64_t time = nanoseconds(*now);
  if (!times_.empty() && time < times_.back().time) {
    for (std::uint32_t slot = 0; slot < edges_.size(); ++slot) forget(slot);
    store_.subtract(times_.size() * sizeof(Moment));
    times_.clear();
  }
  if (!times_.empty() && time == times_.back().time) {
    times_.back().commit = commit;
    return;
  }
  times_.push_back({time, commit});
  store_.add(sizeof(Moment));
  const std::int64_t oldest = saturating_subtract(time, longest_.count());
  while (times_.size() > 1 && times_[1].time <= oldest) {
    times_.pop_front();
    store_.subtract(sizeof(Moment));
  }
}

// What was over at the first commit that can be asked for is needed no more.
void Past::prune(EdgePast& edge) {
  const std::uint64_t first = times_.empty() ? 0 : times_.front().commit;
  while (!edge.samples.empty() && edge.samples.front().until <= first) {
    release(edge.samples.front());
    edge.samples.pop_front();
  }
  while (!edge.states.empty() && edge.states.front().until <= first) {
    store_.subtract(bytes_of(edge.states.front()));
    edge.states.pop_front();
  }
  while (edge.made_up.size() > 1 && edge.made_up[1].since <= first) {
    edge.made_up.pop_front();
    store_.subtract(sizeof(FormerMadeUp));
  }
}

bool Past::drop_some() {
  constexpr std::size_t kShare = 16;
  if (times_.size() < 2) return false;
  const std::size_t count = std::max<std::size_t>(times_.size() / kShare, 1);
  times_.erase(times_.begin(), times_.begin() + static_cast<std::ptrdiff_t>(count));
  store_.subtract(count * sizeof(Moment));
  for (const auto& edge : edges_) {
    if (edge != nullptr) prune(*edge);
  }
  return true;
}

std::optional<std::uint64_t> Past::commit_at(std::int64_t time) const {
  const auto later =
      std::upper_bound(times_.begin(), times_.end(), time,
                       [](std::int64_t t, const Moment& one) { return t < one.time; });
  return later == times_.begin() ? std::nullopt : std::optional(std::prev(later)->commit);
}

std::optional<std::int64_t> Past::known_since(std::uint64_t commit) const {
  const auto first =
      std::lower_bound(times_.begin(), times_.end(), commit,
                       [](const Moment& one, std::uint64_t c) { return one.commit < c; });
  return first == times_.end() ? std::nullopt : std::optional(first->time);
}

}  // namespace tfdude
