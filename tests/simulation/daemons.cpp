#include "simulation/daemons.hpp"

#include <cstdlib>
#include <utility>

#include "simulation/joints.hpp"

namespace tfdude::simulation {
namespace {

using faults::base_edge;
using faults::base_of;

constexpr Instant kLookAfter = milliseconds(20);

}  // namespace

Daemons::Daemons(Surroundings& world, Cast& cast, std::vector<Clock>& clocks, LostPower lost_power)
    : world_(world),
      cast_(cast),
      clocks_(clocks),
      lost_power_(std::move(lost_power)),
      disks_(world.plan.owners + 1, Disk(world.plan.sync)),
      down_(world.plan.owners, 0) {}

void Daemons::start() {
  for (std::size_t i = 0; i < cast_.daemons.size(); ++i) start(i, disk_of(i));
  look_after();
}

std::size_t Daemons::disk_number(std::size_t owner) const {
  return cast_.name_of_daemon(owner) == "renamed" ? cast_.daemons.size() : owner;
}

Disk* Daemons::disk_of(std::size_t owner) {
  return world_.plan.stores_of(owner) ? &disks_[disk_number(owner)] : nullptr;
}

std::vector<FrameSpec> Daemons::configuration(std::size_t owner) const {
  std::vector<FrameSpec> frames;
  if (owner == 0) frames.push_back({"world", "", {}});
  frames.push_back({base_of(owner), "world", base_edge(owner)});
  const Configured& configured = cast_.configured[owner];
  if (configured.extra) {
    frames.push_back({extra_of(owner), extra_parent_of(owner, configured, world_.plan.owners), {}});
  }
  if (configured.spare == Configured::Spare::kMoved) {
    frames.push_back(moved_by(spare_joint_of(owner), spare_of(owner), base_of(owner)));
  } else if (configured.spare == Configured::Spare::kFixed) {
    frames.push_back({spare_of(owner), base_of(owner), {}});
  }
  if (configured.handed) frames.push_back({kHanded, base_of(owner), {}});
  const auto moved = joint_frames_of(owner, world_.plan);
  frames.insert(frames.end(), moved.begin(), moved.end());
  return frames;
}

void Daemons::start(std::size_t owner, Disk* disk) {
  Process::Setting setting;
  setting.host = owner;
  setting.id = next_process();
  setting.partition = cast_.name_of_daemon(owner);
  setting.configured = configuration(owner);
  setting.disk = disk;
  setting.clock = &clocks_[owner];
  cast_.daemons[owner] = std::make_shared<Process>(world_, setting);
  world_.network.join(cast_.daemons[owner]);
  world_.trace("start of " + setting.partition);
  cast_.daemons[owner]->start();
}

// Of a daemon that hung and the one in its place, one continues. Other daemons that have ended are
// restarted.
void Daemons::look_after() {
  if (replaced_ && replaced_->ended()) replaced_.reset();
  auto& wild = cast_.daemons[cast_.wild];
  if (replaced_ && !replaced_->paused() && wild && wild->ended()) {
    wild = std::exchange(replaced_, nullptr);
  }
  for (std::size_t i = 0; i < cast_.daemons.size(); ++i) {
    const bool awaits = i == cast_.wild && replaced_;
    if (!cast_.daemons[i] || !cast_.daemons[i]->ended() || down_[i] > 0 || awaits) continue;
    world_.count("daemon ended by itself");
    // The former owner of the frame may have returned meanwhile.
    if (cast_.daemons[i]->came_too_early()) cast_.configured[i].handed = false;
    cast_.daemons[i].reset();
    start(i, disk_of(i));
  }
  world_.timeline.after(kLookAfter, {"look"}, [this] { look_after(); });
}

void Daemons::begin(const Fault& fault) {
  if (fault.left_out) return;
  world_.trace(std::string("begin of ") + name_of(fault.kind) + " " + std::to_string(fault.target));
  const bool lasts = fault.end == Instant::max();
  world_.count(std::string(lasts ? "lasting " : "fault ") + name_of(fault.kind));
  if (lasts) stands(fault);
  switch (fault.kind) {
    case FaultKind::kStop:
      if (cast_.daemons[fault.target] && !cast_.daemons[fault.target]->paused()) {
        cast_.daemons[fault.target]->leave();
      }
      return take_down(fault.target, true);
    case FaultKind::kKill:
    case FaultKind::kReconfigure:
    case FaultKind::kDeputize:
      return take_down(fault.target, false);
    case FaultKind::kPowerLoss:
      take_down(fault.target, false);
      return lose_power(fault.target);
    case FaultKind::kRename:
      return take_down(cast_.wild, false);
    case FaultKind::kReplace:
      return replace(fault);
    case FaultKind::kPause:
      return pause(fault);
    case FaultKind::kCut:
      world_.network.cut_in(fault.target, 1);
      return world_.network.cut_out(fault.target, 1);
    case FaultKind::kDeafen:
      return world_.network.cut_in(fault.target, 1);
    case FaultKind::kMute:
      return world_.network.cut_out(fault.target, 1);
    case FaultKind::kPart:
      return world_.network.part(fault.target, fault.other, 1);
    case FaultKind::kStepClock:
      clocks_[fault.target].ahead += fault.step;
      return;
    case FaultKind::kFillDisk:
      disks_[fault.target].set_full(true);
      return;
  }
}

void Daemons::end(const Fault& fault) {
  if (fault.left_out) return;
  world_.trace(std::string("end of ") + name_of(fault.kind) + " " + std::to_string(fault.target));
  switch (fault.kind) {
    case FaultKind::kRename:
      ++cast_.renamed;
      return bring_up(cast_.wild);
    case FaultKind::kReconfigure:
      cast_.configured[fault.target].change(static_cast<std::size_t>(std::abs(fault.step.count())));
      return bring_up(fault.target);
    case FaultKind::kDeputize:
      cast_.configured[fault.target].handed = true;
      return bring_up(fault.target);
    case FaultKind::kStop:
    case FaultKind::kKill:
    case FaultKind::kPowerLoss:
      return bring_up(fault.target);
    case FaultKind::kReplace:
      if (replaced_ && replaced_by_ == &fault) replaced_->resume();
      return;
    case FaultKind::kPause:
      if (const auto hung = hung_[&fault].lock()) hung->resume();
      return;
    case FaultKind::kCut:
      world_.network.cut_in(fault.target, -1);
      return world_.network.cut_out(fault.target, -1);
    case FaultKind::kDeafen:
      return world_.network.cut_in(fault.target, -1);
    case FaultKind::kMute:
      return world_.network.cut_out(fault.target, -1);
    case FaultKind::kPart:
      return world_.network.part(fault.target, fault.other, -1);
    case FaultKind::kStepClock:
      return;
    case FaultKind::kFillDisk:
      disks_[fault.target].set_full(false);
      return;
  }
}

// What the others may expect of a daemon whose fault lasts.
void Daemons::stands(const Fault& fault) {
  const bool heard = fault.kind == FaultKind::kFillDisk || fault.kind == FaultKind::kPart;
  const auto standing = heard ? Cast::Standing::kAside : Cast::Standing::kOut;
  cast_.standings[fault.target] = standing;
  if (fault.kind == FaultKind::kPart) cast_.standings[fault.other] = standing;
  if (fault.target == cast_.wild) replaced_.reset();
}

// Starts another process on another computer, which has no stored state of it.
void Daemons::replace(const Fault& fault) {
  auto& wild = cast_.daemons[cast_.wild];
  if (!wild || wild->paused() || replaced_) return;
  wild->pause();
  replaced_ = std::exchange(wild, nullptr);
  replaced_by_ = &fault;
  start(cast_.wild, nullptr);
}

void Daemons::pause(const Fault& fault) {
  // Not restarted if it has just ended.
  if (fault.end == Instant::max()) ++down_[fault.target];
  const auto& daemon = cast_.daemons[fault.target];
  if (!daemon) return;
  daemon->pause();
  hung_[&fault] = daemon;
}

// The last message of a stopping daemon is still sent.
void Daemons::take_down(std::size_t owner, bool gently) {
  ++down_[owner];
  if (owner == cast_.wild) replaced_.reset();
  if (!cast_.daemons[owner]) return;
  auto dying = std::exchange(cast_.daemons[owner], nullptr);
  if (gently) world_.timeline.after(milliseconds(5), {"end"}, [dying] {});
}

void Daemons::bring_up(std::size_t owner) {
  if (--down_[owner] == 0 && !cast_.daemons[owner]) start(owner, disk_of(owner));
}

void Daemons::lose_power(std::size_t owner) {
  Disk& disk = disks_[disk_number(owner)];
  const auto first = disk.lose_power(world_.random);
  if (!first) return;
  if (world_.plan.sync) world_.violation("a synced change is lost", cast_.name_of_daemon(owner));
  world_.count("a power loss has lost stored changes");
  lost_power_(cast_.name_of_daemon(owner), *first);
}

}  // namespace tfdude::simulation
