#include "runtime/many_lookups.hpp"

#include <algorithm>
#include <optional>
#include <unordered_map>
#include <utility>

#include "calls/instants_task.hpp"
#include "calls/lookup_many_task.hpp"
#include "runtime/after_wait.hpp"
#include "types/trajectory_builder.hpp"

namespace tfdude {
namespace {

auto answers(const std::vector<ManyLookups::Found>& all) {
  return std::count_if(all.begin(), all.end(), [](const auto& one) { return one.has_value(); });
}

}  // namespace

std::vector<ManyLookups::Found> ManyLookups::lookup_once(const std::vector<FramePair>& pairs,
                                                         const Query& query,
                                                         const Deadline& deadline) {
  LookupManyTask task(structure_.forest, structure_.clock.kind(), hints_, pairs, query);
  // Frames that are not discovered by then leave some time to ask for the others.
  const Deadline first =
      discovery_.complete() ? deadline : deadline.within(deadline.left() / 4 * 3);
  auto asked = requests_.run(task, first);
  // Those that do not exist are known by now: the others are asked for without them.
  const bool in_time = first.at() < deadline.at();
  if (!asked && (task.settle(asked.error()) || (in_time && asked.error().code == Errc::kTimeout))) {
    asked = requests_.run(task, deadline);
  }
  if (asked) {
    lookups_.asked(task.parts());
  } else {
    task.fail_all(asked.error());
  }
  for (Found& one : task.found()) {
    const bool is_missing = asked && !one && may_appear(one.error().code);
    if (is_missing) one = tl::unexpected(discovery_.explained(std::move(one.error())));
  }
  return std::move(task.found());
}

std::vector<ManyLookups::Found> ManyLookups::lookup(const std::vector<FramePair>& pairs,
                                                    const Query& query, Milliseconds wait) {
  if (wait <= Milliseconds(0)) return lookup_once(pairs, query, discovery_.call_deadline());
  const Deadline until(wait);
  std::vector<Found> before;
  for (auto pause = kShortestPause;; pause = std::min(2 * pause, kLongestPause)) {
    auto found = lookup_once(pairs, query, until.within(timeout_));
    // A round that the end of the wait has cut short says less than the one before.
    if (until.over()) return answers(found) > answers(before) || before.empty() ? found : before;
    std::size_t i = 0;
    while (i < found.size() && (found[i] || !is_worth_waiting(found[i].error(), query))) ++i;
    if (i == found.size()) return found;
    // Alone it may have an answer at once, but not at the instant of the others.
    const auto next = std::min(Deadline(pause).at(), until.at());
    (void)lookups_.wait(pairs[i].a, pairs[i].b, query, until.left());
    if (!lookups_.pause(next) || until.over()) return found;
    before = std::move(found);
  }
}

Result<Trajectory> ManyLookups::trajectory(std::string_view a, std::string_view b,
                                           const std::vector<Time>& instants, const Query& query,
                                           Milliseconds wait) {
  const auto ready = [&](Milliseconds left) -> Result<void> {
    if (instants.empty()) return {};
    Query last = query;
    last.at = *std::max_element(instants.begin(), instants.end());
    // Without its answer, the others may have theirs.
    (void)lookups_.wait(a, b, last, left);
    return {};
  };
  return after_wait(lookups_, wait, ready, [&] { return trajectory_once(a, b, instants, query); });
}

Result<Trajectory> ManyLookups::trajectory_once(std::string_view a, std::string_view b,
                                                const std::vector<Time>& instants,
                                                const Query& query) {
  TrajectoryBuilder all(instants.size());
  Query at = query;
  const auto from = structure_.forest.find(a);
  const auto to = structure_.forest.find(b);
  for (std::size_t i = 0; i < instants.size();) {
    at.at = instants[i];
    if (from && to) {
      const auto found = lookups_.read(*from, *to, at);
      if (found || Lookups::is_of_time(found.error())) {
        all.add(i++, found);
        continue;
      }
    }
    // No message can name an instant before zero.
    if (instants[i] < Time{}) {
      all.add(i, lookups_.lookup(a, b, at));
      ++i;
      continue;
    }
    const auto begin = instants.begin() + static_cast<std::ptrdiff_t>(i);
    const auto most =
        begin + static_cast<std::ptrdiff_t>(std::min(instants.size() - i, InstantsTask::kMost));
    const auto end = std::find_if(begin, most, [](Time t) { return t < Time{}; });
    InstantsTask task(structure_.forest, structure_.clock.kind(),
                      {std::string(a), std::string(b), query}, {begin, end});
    auto asked = requests_.run(task, discovery_.call_deadline());
    if (!asked) return tl::unexpected(asked.error());
    lookups_.asked(task.planned());
    for (const auto& found : task.found()) all.add(i++, found);
  }
  return std::move(all).take();
}

}  // namespace tfdude
