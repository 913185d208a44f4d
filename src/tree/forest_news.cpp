#include <algorithm>
#include <cmath>

#include "tree/forest_impl.hpp"

// What happened to edges: for those who follow them, and for statistics.
namespace tfdude {
namespace {

PastInfo past_of(const HeldVersion& edge) {
  PastInfo info;
  info.id = edge.name->text;
  const Refused& refused = edge.name->refused;
  info.refused_old = refused.old.load(std::memory_order_relaxed);
  info.refused_equal = refused.equal.load(std::memory_order_relaxed);
  info.refused_ahead = refused.ahead.load(std::memory_order_relaxed);
  if (edge.ring == nullptr) return info;
  const Ring& ring = *edge.ring;
  info.span_limit = ring.timing().span;
  info.count_limit = ring.timing().count;
  info.bytes = ring.bytes();
  if (!edge.moving()) return info;
  double sum = 0;
  double squares = 0;
  std::int64_t before = kAlways;
  for (std::uint64_t number = ring.oldest(); number <= edge.number; ++number) {
    const std::int64_t stamp = ring.stamp(number);
    if (stamp == kAlways) continue;  // dropped meanwhile
    ++info.samples;
    if (before == kAlways) {
      info.oldest = time_of(stamp);
    } else {
      const std::int64_t gap = stamp - before;
      sum += static_cast<double>(gap);
      squares += static_cast<double>(gap) * static_cast<double>(gap);
      info.max_gap = std::max(info.max_gap, std::chrono::nanoseconds(gap));
    }
    before = stamp;
  }
  info.newest = time_of(edge.stamp);
  info.bytes += info.samples * sizeof(HeldVersion);
  if (info.samples < 2) return info;
  const double gaps = static_cast<double>(info.samples - 1);
  const double mean = sum / gaps;
  info.mean_gap = std::chrono::nanoseconds(std::llround(mean));
  info.jitter = std::chrono::nanoseconds(
      std::llround(std::sqrt(std::max(squares / gaps - mean * mean, 0.0))));
  return info;
}

Correlation correlation_of(const HeldVersion& edge) {
  return edge.ties != nullptr ? edge.ties->now : Correlation();
}

void add_news(const HeldVersion& edge, std::uint32_t index, EdgeCursor& cursor, bool newest_only,
              std::vector<News>& news) {
  if (!edge.moving()) {
    if (edge.commit <= cursor.commit && cursor.commit != 0) return;
    news.push_back({index, std::nullopt, edge.X_PC, correlation_of(edge)});
    cursor.commit = edge.commit;
    cursor.stamp.reset();
    return;
  }
  const std::int64_t seen = cursor.stamp ? nanoseconds(*cursor.stamp) : kAlways;
  const Ring& ring = *edge.ring;
  // Who has seen nothing yet is told where the edge is, not its whole past.
  const bool one = newest_only || seen == kAlways;
  std::uint64_t first = edge.number;
  while (!one && first > ring.oldest() && ring.stamp(first - 1) > seen) --first;
  for (std::uint64_t number = first; number < edge.number; ++number) {
    const HeldVersion* sample = ring.sample(number);
    if (sample != nullptr) {
      news.push_back({index, time_of(sample->stamp), sample->X_PC, correlation_of(edge)});
    }
  }
  if (edge.stamp > seen) {
    news.push_back({index, time_of(edge.stamp), edge.X_PC, correlation_of(edge)});
  }
  cursor.stamp = time_of(std::max(edge.stamp, seen));
}

}  // namespace

std::vector<News> Forest::news(std::vector<EdgeCursor>& cursors, bool newest_only) const {
  const epoch::Guard guard;
  const std::uint64_t commit = impl_->snapshot();
  std::vector<News> all;
  for (std::uint32_t index = 0; index < cursors.size(); ++index) {
    const Version* version = impl_->of(cursors[index].frame, commit);
    if (version == nullptr || !version->held()) continue;
    add_news(static_cast<const HeldVersion&>(*version), index, cursors[index], newest_only, all);
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const News& a, const News& b) { return a.stamp < b.stamp; });
  return all;
}

std::vector<PastInfo> Forest::pasts(std::string_view id) const {
  const epoch::Guard guard;
  const std::uint64_t commit = impl_->snapshot();
  std::vector<PastInfo> all;
  const auto add = [&all](const Version* version) {
    if (version == nullptr || !version->held()) return;
    const auto& edge = static_cast<const HeldVersion&>(*version);
    const bool refused = edge.name->refused.ahead.load(std::memory_order_relaxed) > 0;
    if (edge.ring != nullptr || refused) all.push_back(past_of(edge));
  };
  if (!id.empty()) {
    add(impl_->present(id, commit));
    return all;
  }
  for (std::uint32_t slot = 0; slot < impl_->slots_.size(); ++slot) add(impl_->at(slot, commit));
  return all;
}

void Forest::on_commit(std::function<void()> listener, const void* whose) {
  const std::lock_guard lock(impl_->mutex_);
  auto& all = impl_->commit_listeners_;
  all.erase(std::remove_if(all.begin(), all.end(),
                           [whose](const auto& one) { return one.first == whose; }),
            all.end());
  if (listener) all.emplace_back(whose, std::move(listener));
}

void Forest::on_restart(std::function<void(const HistoryRestart&)> listener) {
  const std::lock_guard lock(impl_->mutex_);
  impl_->restart_listener_ = std::move(listener);
}

}  // namespace tfdude
