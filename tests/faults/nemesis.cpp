#include "faults/nemesis.hpp"

#include <algorithm>
#include <limits>
#include <thread>

#include "faults/worker.hpp"

namespace tfdude::faults {
namespace {

// The interval of checking the daemons.
constexpr double kLookEvery = 0.02;

constexpr double kNever = std::numeric_limits<double>::infinity();

std::string name_of(FaultKind kind) {
  switch (kind) {
    case FaultKind::kKill:
      return "kill";
    case FaultKind::kPause:
      return "pause";
    case FaultKind::kCutDaemon:
      return "cut of a daemon";
    case FaultKind::kUnplug:
      return "unplugged cable of a daemon";
    case FaultKind::kCutClient:
      return "cut of a client";
    case FaultKind::kReconfigure:
      return "another configuration";
    case FaultKind::kStepClock:
      return "step of the clock";
    case FaultKind::kFillDisk:
      return "full disk";
    case FaultKind::kPart:
      break;
  }
  return "cut between two daemons";
}

std::string target_of(const Fault& fault) {
  if (fault.kind == FaultKind::kFillDisk) return "all daemons";
  if (fault.kind == FaultKind::kCutClient) return "client " + std::to_string(fault.target);
  std::string target = partition_name(fault.target);
  if (fault.kind == FaultKind::kPart) target += " and " + partition_name(fault.other);
  return target;
}

}  // namespace

void Nemesis::note(const std::string& what, const Fault& fault) {
  journal_.fault(what + name_of(fault.kind) + ", " + target_of(fault));
}

void Nemesis::run(const std::vector<Fault>& faults, double seconds) {
  const double begin_at = journal_.now();
  const auto now = [&] { return journal_.now() - begin_at; };
  auto next = faults.begin();
  while (now() < seconds || !endings_.empty()) {
    // In their order, also if this thread comes late: a host may be cut off again just after it was
    // not.
    while (true) {
      const double ends = endings_.empty() ? kNever : endings_.begin()->first;
      const double begins = next == faults.end() ? kNever : next->begin;
      if (std::min(ends, begins) > now()) break;
      if (begins < ends) {
        begin(*next);
        endings_.emplace(next->end, *next);
        ++next;
      } else {
        const Fault fault = endings_.begin()->second;
        endings_.erase(endings_.begin());
        end(fault);
      }
    }
    watch();
    double wake = now() + kLookEvery;
    if (next != faults.end()) wake = std::min(wake, next->begin);
    if (!endings_.empty()) wake = std::min(wake, endings_.begin()->first);
    std::this_thread::sleep_for(std::chrono::duration<double>(std::max(0.0, wake - now())));
  }
  await_starts();
}

bool Nemesis::connected(std::size_t partition) const { return cut_.count(partition) == 0; }

void Nemesis::kill(std::size_t partition) {
  cluster_.kill(partition);
  if (starting_.erase(partition) > 0) {
    // The daemon never served, so nobody can notice that it is gone.
    observer_.disregard(partition);
    journal_.calm_down();
  } else if (connected(partition)) {
    observer_.died(partition);
  }
}

void Nemesis::begin(const Fault& fault) {
  journal_.disturb();
  journal_.count("fault", name_of(fault.kind));
  note("", fault);
  switch (fault.kind) {
    case FaultKind::kReconfigure:
      cluster_.configure(fault.target, fault.variant);
      kill(fault.target);
      break;
    case FaultKind::kKill:
      kill(fault.target);
      break;
    case FaultKind::kStepClock:
      cluster_.step_clock(fault.target, fault.step);
      break;
    case FaultKind::kFillDisk:
      // A daemon that starts needs room on the disk, and ends if there is none.
      if (starting_.empty()) cluster_.fill_disk();
      break;
    case FaultKind::kPause:
      cluster_.pause(fault.target);
      observer_.disregard(fault.target);
      break;
    case FaultKind::kCutDaemon:
      cluster_.cut(cluster_.daemon_host(fault.target));
      cut_.insert(fault.target);
      observer_.disregard(fault.target);
      break;
    case FaultKind::kUnplug:
      cluster_.unplug(cluster_.daemon_host(fault.target));
      cut_.insert(fault.target);
      observer_.disregard(fault.target);
      break;
    case FaultKind::kCutClient:
      cluster_.cut(cluster_.client_host(fault.target));
      break;
    case FaultKind::kPart:
      cluster_.part(cluster_.daemon_host(fault.target), cluster_.daemon_host(fault.other));
      break;
  }
}

void Nemesis::end(const Fault& fault) {
  note("end of ", fault);
  switch (fault.kind) {
    case FaultKind::kKill:
    case FaultKind::kReconfigure:
      start(fault.target);
      break;
    case FaultKind::kStepClock:
      cluster_.step_clock(fault.target, 0);
      break;
    case FaultKind::kFillDisk:
      cluster_.clear_disk();
      break;
    case FaultKind::kPause:
      cluster_.resume(fault.target);
      break;
    case FaultKind::kCutDaemon:
      cluster_.heal(cluster_.daemon_host(fault.target));
      cut_.erase(cut_.find(fault.target));
      break;
    case FaultKind::kUnplug:
      cluster_.plug(cluster_.daemon_host(fault.target));
      cut_.erase(cut_.find(fault.target));
      break;
    case FaultKind::kCutClient:
      cluster_.heal(cluster_.client_host(fault.target));
      break;
    case FaultKind::kPart:
      cluster_.join(cluster_.daemon_host(fault.target), cluster_.daemon_host(fault.other));
      break;
  }
  journal_.calm_down();
}

void Nemesis::start(std::size_t partition) {
  cluster_.start(partition);
  // Waits until it serves.
  journal_.disturb();
  starting_.insert(partition);
  if (connected(partition)) observer_.started(partition);
}

void Nemesis::watch() {
  for (const std::string& ended : cluster_.take_ended()) {
    journal_.violation("a daemon has ended of its own accord: " + ended);
  }
  for (auto at = starting_.begin(); at != starting_.end();) {
    if (!cluster_.ready(*at) && cluster_.runs(*at)) {
      ++at;
      continue;
    }
    journal_.fault("ready, " + partition_name(*at));
    journal_.calm_down();
    at = starting_.erase(at);
  }
}

void Nemesis::await_starts() {
  const auto deadline = testing::in_time();
  while (!starting_.empty() && Clock::now() < deadline) {
    watch();
    std::this_thread::sleep_for(std::chrono::duration<double>(kLookEvery));
  }
  for (const std::size_t partition : starting_) {
    journal_.violation(partition_name(partition) + " does not get ready:\n" +
                       cluster_.log_of(partition));
  }
}

void Nemesis::restart_all() {
  journal_.fault("kill of all");
  for (std::size_t i = 0; i < cluster_.partitions(); ++i) {
    cluster_.kill(i);
    observer_.died(i);
  }
  for (std::size_t i = 0; i < cluster_.partitions(); ++i) start(i);
  await_starts();
}

}  // namespace tfdude::faults
