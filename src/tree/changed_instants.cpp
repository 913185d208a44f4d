#include "tree/changed_instants.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <string_view>

#include "tfdude/types/joint_spec.hpp"

#include "tree/held_edges.hpp"

namespace tfdude {
namespace {

// Instants, including both; none if first > last.
struct Span {
  std::int64_t first = std::numeric_limits<std::int64_t>::max();
  std::int64_t last = kAlways;

  void add(std::int64_t t) {
    first = std::min(first, t);
    last = std::max(last, t);
  }
};

constexpr Span kAllInstants{kAlways, std::numeric_limits<std::int64_t>::max()};

// Adds the instants, up to the last one for which the edge was looked up at that commit, for which
// it has another value now: those between a new sample and its neighbours. Samples that follow the
// last instant change nothing.
void add_changed(const HeldVersion& edge, std::uint64_t since, std::int64_t until, Span& changed) {
  const SampleHistory& samples = *edge.samples;
  if (samples.rewritten <= since) return;
  std::int64_t after = kAllInstants.last;
  for (std::uint64_t number = edge.number + 1; number-- > samples.oldest();) {
    const Sample* sample = samples.sample(number);
    if (sample == nullptr) return;
    const std::int64_t before = number > 0 ? samples.stamp(number - 1) : kAlways;
    if (sample->commit > since && before < until) {
      changed.add(before);
      changed.add(after);
    }
    after = sample->stamp;
  }
}

}  // namespace

// A joint says another variance with each position.
std::uint64_t said_of(const std::vector<Ends>& segments) {
  std::uint64_t said = 0;
  const auto add = [&](std::uint64_t number) { said = (said ^ number) * 1099511628211U; };
  const std::hash<std::string_view> hash;
  for_each_held(segments, [&](const HeldVersion& edge) {
    add(1);
    if (edge.correlation == nullptr) return;
    add(edge.correlation->said().unknown ? 2 : 3);
    for (const CommonError& one : edge.correlation->said().common_errors) {
      if (is_of_joints(one.source)) continue;
      add(hash(one.source));
      const auto* loading = reinterpret_cast<const char*>(one.loading.data());
      add(hash({loading, static_cast<std::size_t>(one.loading.size()) * sizeof(double)}));
    }
  });
  return said;
}

std::vector<std::int64_t> changed_instants(const std::vector<Ends>& segments,
                                           const SeenSegments& seen, std::uint64_t said) {
  const std::int64_t until = nanoseconds(seen.until);
  Span changed = seen.said && *seen.said != said ? kAllInstants : Span();
  for_each_held(segments, [&](const HeldVersion& edge) {
    if (edge.moving()) {
      add_changed(edge, seen.commit, until, changed);
    } else if (edge.commit > seen.commit) {
      changed = kAllInstants;
    }
  });
  std::vector<std::int64_t> instants;
  const auto add = [&](std::int64_t t) {
    if (t > until ? !seen.newest_only : t <= changed.last) instants.push_back(t);
  };
  for_each_held(segments, [&](const HeldVersion& edge) {
    if (!edge.moving()) return;
    const Sample* after = nullptr;
    for (std::uint64_t number = edge.number + 1; number-- > edge.samples->oldest();) {
      const Sample* sample = edge.samples->sample(number);
      if (sample == nullptr) break;
      if (after != nullptr) {
        for (const std::int64_t t : instants_between(*sample, *after)) add(t);
      }
      if (sample->stamp <= until && sample->stamp < changed.first) break;
      add(sample->stamp);
      after = sample;
    }
  });
  std::sort(instants.begin(), instants.end());
  instants.erase(std::unique(instants.begin(), instants.end()), instants.end());
  return instants;
}

}  // namespace tfdude
