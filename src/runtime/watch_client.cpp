#include "runtime/watch_client.hpp"

#include <chrono>
#include <cmath>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/base/number.hpp"

#include "partition/routing.hpp"
#include "runtime/member_runner.hpp"
#include "runtime/memory_reads.hpp"
#include "runtime/requests.hpp"

namespace tfdude {
namespace {

Result<void> check_rate(double rate) {
  constexpr double kLeast = 1.0 / std::chrono::duration<double>(kMaxWatchPeriod).count();
  if (rate == 0 || (rate >= kLeast && rate <= 1e6)) return {};
  return fail(
      Errc::kInvalidInput,
      "the rate of a watch must be 0, or from one an hour to 1e6 Hz, not " + number_text(rate));
}

}  // namespace

WatchClient::WatchClient(const Context& context, MemoryReads* memory)
    : context_(context),
      routes_(context.threads.callbacks.line()),
      memory_(memory),
      rounds_(context.requests.replies(), context.options.timeout),
      look_job_(context.threads.push, [this] { return look().again; }),
      job_(context.threads.asking, [this] { return round(); }) {}

void WatchClient::stop() {
  job_.stop();
  context_.structure.forest.on_commit(nullptr, this);
  look_job_.stop();
  rounds_.end();
}

Result<std::shared_ptr<WatchedPath>> WatchClient::watch(const std::string& a, const std::string& b,
                                                        const WatchOptions& options) {
  if (auto ok = check_rate(options.rate); !ok) return tl::unexpected(std::move(ok.error()));
  const Deadline deadline = context_.discovery.call_deadline();
  auto known = context_.requests.find(deadline, {a, b}, Task::kFresh, [&](const Directory&) {
    return context_.structure.forest.segments(a, b);
  });
  if (!known) return tl::unexpected(std::move(known.error()));
  return follow(std::make_shared<WatchedPath>(a, b, options, routes_, memory_), deadline);
}

Result<std::shared_ptr<WatchedPath>> WatchClient::watch_edges(
    const std::vector<std::string>& frames, const WatchOptions& options) {
  if (auto ok = check_rate(options.rate); !ok) return tl::unexpected(std::move(ok.error()));
  if (frames.empty() || options.composed) {
    return fail(Errc::kInvalidInput,
                frames.empty() ? "no edges to watch" : "edges are not a path that can be composed");
  }
  const Deadline deadline = context_.discovery.call_deadline();
  const auto known =
      context_.requests.find(deadline, frames, Task::kFresh, [&](const Directory& directory) {
        return watch_route(context_.structure.forest, directory, frames, {}, 0);
      });
  if (!known) return tl::unexpected(known.error());
  return follow(std::make_shared<WatchedPath>(frames, options, routes_), deadline);
}

Result<std::shared_ptr<WatchedPath>> WatchClient::follow(std::shared_ptr<WatchedPath> path,
                                                         const Deadline& deadline) {
  const auto route = route_of(*path);
  // What is asked for is invalid, so that waiting does not help.
  if (!route && route.error().code == Errc::kInvalidInput) return tl::unexpected(route.error());
  watches_paths_ = true;
  add(path);
  auto live = path->wait_until_live(deadline.at());
  // The rounds have it, too.
  if (live) return std::shared_ptr<WatchedPath>(path.get(), [path](auto* one) { one->leave(); });
  if (live.error().code == Errc::kNotYet) return unanswered(*path, deadline);
  return tl::unexpected(std::move(live.error()));
}

Result<WatchRoute> WatchClient::route_of(const WatchedPath& path) {
  const std::uint64_t own_incarnation = context_.member.incarnation();
  Structure& structure = context_.structure;
  const Lock lock(structure.mutex);
  return path.route({structure.forest, structure.directory, own_incarnation});
}

tl::unexpected<Error> WatchClient::unanswered(const WatchedPath& path, const Deadline& deadline) {
  std::string owners;
  if (const auto route = route_of(path)) {
    for (const WatchRoute::Source& source : route->sources) {
      owners += (owners.empty() ? "" : ", ") + quote(source.partition);
    }
  }
  return fail(Errc::kTimeout, "of the owners of the " + path.described() + " (" + owners +
                                  ") not all answered within " + deadline.text());
}

Result<std::shared_ptr<WatchedPartition>> WatchClient::watch_partition(
    const std::string& partition, double rate, WatchedPartition::Listener listener) {
  if (auto ok = check_rate(rate); !ok) return tl::unexpected(std::move(ok.error()));
  if (auto ok = context_.requests.check_keeps_all("watch partition " + quote(partition)); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  const Deadline deadline = context_.discovery.call_deadline();
  auto known = context_.requests.find(deadline, [&](const Directory& directory) -> Result<void> {
    if (directory.owner(partition)) return {};
    return fail_without_partition(partition);
  });
  if (!known) return tl::unexpected(std::move(known.error()));
  // So that the first list of frames is complete; if something is missing, it follows.
  (void)context_.discovery.await(deadline);
  const Milliseconds gather = rate > 0 ? Milliseconds(0) : WatchedPartition::kGather;
  auto watched = std::make_shared<WatchedPartition>(partition, rate, std::move(listener),
                                                    context_.threads.callbacks.line(gather));
  add(watched);
  return watched;
}

bool WatchClient::on_pushed(const PushedValues& pushed) {
  const auto due = rounds_.on_pushed(pushed, Loop::Clock::now());
  if (due != WatchRounds::kNever) job_.ask_by(due);
  return watches_paths_;
}

void WatchClient::add(std::shared_ptr<Watched> watched) {
  rounds_.add(std::move(watched));
  job_.ask();
}

Loop::Clock::time_point WatchClient::round() {
  rounds_.begin(Loop::Clock::now());
  while (PendingRequests* asked = rounds_.step(Loop::Clock::now(), *this)) {
    context_.requests.await(*asked, Deadline(context_.options.timeout));
  }
  wait_for_commits();
  return rounds_.next();
}

void WatchClient::wait_for_commits() {
  if (memory_ == nullptr) return;
  std::set<Owner> owners = rounds_.owners_in_memory();
  const bool own = owners.erase(kHeldHere) > 0;
  memory_->wait_for(owners);
  std::function<void()> listener;
  if (own) listener = [this] { look_job_.ask(); };
  context_.structure.forest.on_commit(std::move(listener), this);
  // Of what was committed before.
  if (own && !std::exchange(hears_own_, own)) look_job_.ask();
  hears_own_ = own;
}

Result<void> WatchClient::plan(Watched& watched) {
  const std::uint64_t own_incarnation = context_.member.incarnation();
  // If nobody can say whether the route is still right, the known one must do.
  auto known =
      context_.requests.know(watched.frames(), Task::kFresh, Deadline(context_.options.timeout));
  Structure& structure = context_.structure;
  const Lock lock(structure.mutex);
  auto planned = watched.plan({structure.forest, structure.directory, own_incarnation});
  return planned || known ? planned : known;
}

}  // namespace tfdude
