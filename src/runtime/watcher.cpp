#include "runtime/watcher.hpp"

#include <chrono>
#include <cmath>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/base/number.hpp"

namespace tfdude {
namespace {

Result<void> check_rate(double rate) {
  constexpr double kLeast = 1.0 / std::chrono::duration<double>(kMaxWatchPeriod).count();
  if (rate == 0 || (rate >= kLeast && rate <= 1e6)) return {};
  return fail(
      Errc::kInvalidInput,
      "the rate of a watch must be 0, or from one an hour to 1e6 Hz, not " + number_text(rate));
}

std::chrono::nanoseconds period_of(double rate) {
  return std::chrono::nanoseconds(rate > 0 ? std::llround(1e9 / rate) : 0);
}

}  // namespace

void Watcher::stop() {
  if (Watches* watches = watching_.load()) watches->stop();
  if (PartitionWatches* watches = watching_partitions_.load()) watches->stop();
}

Result<std::shared_ptr<WatchedPath>> Watcher::watch(const std::string& a, const std::string& b,
                                                    const WatchOptions& options) {
  if (auto ok = check_rate(options.rate); !ok) return tl::unexpected(std::move(ok.error()));
  const Deadline deadline = discovery_.call_deadline();
  auto known = requests_.find(deadline, {a, b}, Task::kFresh,
                              [&](const Directory&) { return structure_.forest.segments(a, b); });
  if (!known) return tl::unexpected(std::move(known.error()));
  return follow(std::make_shared<WatchedPath>(a, b, options), deadline);
}

Result<std::shared_ptr<WatchedPath>> Watcher::watch_edges(const std::vector<std::string>& frames,
                                                          const WatchOptions& options) {
  if (auto ok = check_rate(options.rate); !ok) return tl::unexpected(std::move(ok.error()));
  if (frames.empty() || options.composed) {
    return fail(Errc::kInvalidInput,
                frames.empty() ? "no edges to watch" : "edges are not a path that can be composed");
  }
  const Deadline deadline = discovery_.call_deadline();
  const auto known =
      requests_.find(deadline, frames, Task::kFresh, [&](const Directory& directory) {
        return watch_route(structure_.forest, directory, frames, {}, 0);
      });
  if (!known) return tl::unexpected(known.error());
  return follow(std::make_shared<WatchedPath>(frames, options), deadline);
}

Result<std::shared_ptr<WatchedPath>> Watcher::follow(std::shared_ptr<WatchedPath> path,
                                                     const Deadline& deadline) {
  watches().watch(path);
  auto live = path->wait_until_live(deadline.at());
  if (live) return path;
  if (live.error().code == Errc::kNotYet) return unanswered(*path, deadline);
  return tl::unexpected(std::move(live.error()));
}

tl::unexpected<Error> Watcher::unanswered(const WatchedPath& path, const Deadline& deadline) {
  std::string owners;
  if (const auto route = plan(path)) {
    for (const WatchRoute::Source& source : route->sources) {
      owners += (owners.empty() ? "" : ", ") + quote(source.partition);
    }
  }
  return fail(Errc::kTimeout, "of the owners of the " + path.described() + " (" + owners +
                                  ") not all answered within " + deadline.text());
}

Watches& Watcher::watches() {
  const Lock lock(mutex_);
  if (watches_ == nullptr) {
    watches_ = std::make_unique<Watches>(Watches::Links{
        [this](const WatchedPath& path) { return plan(path); },
        [this](std::vector<Part>& parts) { return requests_.ask(parts, Deadline(timeout_)); },
        [this](const std::string& owner, std::uint64_t group) {
          return readers_.open(owner, group);
        },
        [this](std::uint64_t group) { readers_.close(group); }});
    watching_.store(watches_.get());
  }
  return *watches_;
}

Result<std::shared_ptr<FollowedPartition>> Watcher::watch_partition(
    const std::string& partition, double rate, FollowedPartition::Listener listener) {
  if (auto ok = check_rate(rate); !ok) return tl::unexpected(std::move(ok.error()));
  if (auto ok = requests_.check_keeps_all("watch partition " + quote(partition)); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  const Deadline deadline = discovery_.call_deadline();
  auto known = requests_.find(deadline, [&](const Directory& directory) -> Result<void> {
    if (directory.owner(partition)) return {};
    return fail(Errc::kUnknownPartition, "no partition " + quote(partition));
  });
  if (!known) return tl::unexpected(std::move(known.error()));
  // So that the first list of frames is complete; if something is missing, it follows.
  (void)discovery_.await(deadline);
  auto followed =
      std::make_shared<FollowedPartition>(partition, period_of(rate), std::move(listener));
  partition_watches().add(followed);
  return followed;
}

PartitionWatches& Watcher::partition_watches() {
  const Lock lock(mutex_);
  if (partition_watches_ == nullptr) {
    partition_watches_ = std::make_unique<PartitionWatches>(PartitionWatches::Links{
        [this](const FollowedPartition& partition) { return plan(partition); },
        [this](std::vector<Part>& parts) { return requests_.ask(parts, Deadline(timeout_)); },
        [this](const std::string& owner, std::uint64_t group) {
          return readers_.open(owner, group);
        },
        [this](std::uint64_t group) { readers_.close(group); }});
    watching_partitions_.store(partition_watches_.get());
  }
  return *partition_watches_;
}

Result<PartitionPlan> Watcher::plan(const FollowedPartition& partition) {
  const std::uint64_t own_incarnation = incarnation_();
  const Lock lock(structure_.mutex);
  return plan_partition(structure_.forest, structure_.directory, partition.name(),
                        partition.period(), own_incarnation, partition.most());
}

Result<WatchRoute> Watcher::plan(const WatchedPath& path) {
  const WatchOptions& options = path.options();
  const std::uint64_t own_incarnation = incarnation_();
  // If nobody can say whether the route is still right, the known one must do.
  const auto names =
      path.frames().empty() ? std::vector<std::string>{path.a(), path.b()} : path.frames();
  const auto known = requests_.know(names, Task::kFresh, Deadline(timeout_));
  const auto period = period_of(options.rate);
  const Lock lock(structure_.mutex);
  auto route = path.frames().empty()
                   ? watch_route(structure_.forest, structure_.directory, path.a(), path.b(),
                                 options.composed, period, own_incarnation)
                   : watch_route(structure_.forest, structure_.directory, path.frames(), period,
                                 own_incarnation);
  if (!route && !known) return tl::unexpected(known.error());
  return route;
}

bool Watcher::on_pushed(const PushedValues& pushed) {
  if (PartitionWatches* watches = watching_partitions_.load()) watches->on_pushed(pushed);
  Watches* watches = watching_.load();
  if (watches == nullptr) return false;
  watches->on_pushed(pushed);
  return true;
}

bool Watcher::can_answer(const std::string& a, const std::string& b, const Query& query) const {
  const Watches* watches = watching_.load();
  return watches != nullptr && watches->can_answer(a, b, query);
}

void Watcher::look_again() {
  if (Watches* watches = watching_.load()) watches->look_again();
  if (PartitionWatches* watches = watching_partitions_.load()) watches->look_again();
}

}  // namespace tfdude
