#include "simulation/world.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "simulation/verdict.hpp"

namespace tfdude::simulation {
namespace {

using faults::base_edge;
using faults::base_of;

constexpr Instant kLook = milliseconds(20);
constexpr std::size_t kMostFailures = 10;
// Longer than a participant takes to count as gone, to be discovered again, to claim its name and
// to yield.
constexpr Instant kRest = milliseconds(12000);

class World {
 public:
  World(const Plan& plan, bool trace)
      : plan_(plan),
        trace_(trace),
        timeline_(plan.seed),
        network_(timeline_, plan),
        random_(plan.seed ^ 0x776f726cU),
        invariants_([this](const auto& kind, const auto& what) { violation(kind, what); }),
        surroundings_{timeline_,
                      network_,
                      plan_,
                      random_,
                      [this](const std::string& step) { note(step); },
                      [this](const auto& kind, const auto& what) { violation(kind, what); },
                      [this](const std::string& what) { ++run_.counts[what]; },
                      run_.steps,
                      invariants_},
        cast_(plan),
        disks_(plan.owners + 1),
        offsets_(plan.owners),
        down_(plan.owners, 0) {
    run_.steps.add({}, {"start"});
    timeline_.watch([this](const Touch& touch) { run_.steps.add(timeline_.now(), touch); },
                    [this](const Touch& touch) { look_at(touch); });
  }

  Run run() {
    for (std::size_t i = 0; i < plan_.owners; ++i) start_daemon(i);
    for (std::size_t i = 0; i < plan_.clients; ++i) start_author(i);
    for (std::size_t i = 0; i < plan_.followers; ++i) start_follower(i);
    for (const Fault& fault : plan_.faults) {
      timeline_.at(fault.begin, {"fault"}, [this, &fault] { begin(fault); });
      timeline_.at(fault.end, {"end of fault"}, [this, &fault] { end(fault); });
    }
    look_after();
    advance(plan_.storm);
    for (const auto& author : cast_.authors) author->stop();
    for (const auto& follower : cast_.followers) follower->stop();
    network_.set_loss(plan_.loss_after);
    if (plan_.lost < plan_.owners) take_down(plan_.lost, false);
    advance(plan_.storm + kRest);
    Verdict({plan_,
             cast_,
             frames_named(),
             {[this](const auto& kind, const auto& what) { violation(kind, what); },
              [this](const std::string& what, std::size_t n) { run_.counts[what] += n; },
              [this](Instant wait) { advance(timeline_.now() + wait); }}})
        .check();
    if (replaced_) violation("one that was replaced serves on", replaced_->partition());
    for (const auto& author : cast_.authors) {
      for (const auto& [what, count] : author->outcomes()) run_.counts[what] += count;
    }
    for (const auto& follower : cast_.followers) {
      for (const auto& [what, count] : follower->outcomes()) run_.counts[what] += count;
    }
    run_.duration = timeline_.now();
    return std::move(run_);
  }

 private:
  void advance(Instant until) {
    while (timeline_.step(until)) {
    }
  }

  // What an event has changed, and whether that is allowed.
  void look_at(const Touch& touch) {
    if (const auto touched = touch.who != 0 ? network_.find(touch.who) : nullptr) {
      run_.steps.mix(touched->forest().structure_version());
      run_.steps.mix(touched->directory().latest_lamport_time());
      run_.steps.mix(touched->member().presence().incarnation + touched->open_calls());
      invariants_.after(*touched);
    }
    invariants_.after(timeline_.now());
  }

  void note(const std::string& step) {
    run_.steps.mix(step);
    if (trace_)
      std::printf("%12.3f ms  %s\n",
                  std::chrono::duration<double, std::milli>(timeline_.now()).count(), step.c_str());
  }

  void violation(const std::string& kind, const std::string& what) {
    note("VIOLATION: " + kind + ": " + what);
    if (run_.failures.size() >= kMostFailures) return;
    run_.failures.push_back(
        {kind, std::to_string(timeline_.now().count() / 1'000'000) + " ms: " + what});
  }

  // How many frames anybody has tried to add, including those of the configurations.
  [[nodiscard]] std::size_t frames_named() const {
    std::size_t named = 1 + 2 * plan_.owners + kContested;
    for (const auto& author : cast_.authors) named += author->added();
    for (const auto& follower : cast_.followers) named += follower->added();
    return named;
  }

  [[nodiscard]] Disk* disk_of(std::size_t owner) {
    if (!plan_.stores_of(owner)) return nullptr;
    return &disks_[cast_.name_of_daemon(owner) == "renamed" ? plan_.owners : owner];
  }

  void start_daemon(std::size_t owner) { start_daemon(owner, disk_of(owner)); }

  void start_daemon(std::size_t owner, Disk* disk) {
    Process::Setting setting;
    setting.host = owner;
    setting.id = ++processes_;
    setting.partition = cast_.name_of_daemon(owner);
    if (owner == 0) setting.configured.push_back({"world", "", {}});
    setting.configured.push_back({base_of(owner), "world", base_edge(owner)});
    if (cast_.has_extra[owner]) setting.configured.push_back({extra_of(owner), base_of(owner), {}});
    setting.disk = disk;
    setting.clock_offset = &offsets_[owner];
    cast_.daemons[owner] = std::make_shared<Process>(surroundings_, setting);
    network_.join(cast_.daemons[owner]);
    note("start of " + setting.partition);
    cast_.daemons[owner]->start();
  }

  void start_author(std::size_t number) {
    Process::Setting setting;
    setting.host = plan_.owners + number;
    setting.id = ++processes_;
    auto process = std::make_shared<Process>(surroundings_, setting);
    network_.join(process);
    process->start();
    cast_.authors.push_back(
        std::make_shared<Author>(process, number, cast_.wild, plan_.seed * 31 + number));
    cast_.authors.back()->start();
  }

  void start_follower(std::size_t number) {
    Process::Setting setting;
    setting.host = plan_.owners + plan_.clients + number;
    setting.id = ++processes_;
    auto process = std::make_shared<Process>(surroundings_, setting);
    network_.join(process);
    process->start();
    cast_.followers.push_back(
        std::make_shared<Follower>(process, number, cast_.wild, plan_.seed * 37 + number));
    cast_.followers.back()->start();
  }

  // Of a daemon that hung and the one in its place, one continues. Other daemons that have ended
  // are restarted.
  void look_after() {
    if (replaced_ && replaced_->ended()) replaced_.reset();
    if (replaced_ && !replaced_->paused() && cast_.daemons[cast_.wild] &&
        cast_.daemons[cast_.wild]->ended()) {
      cast_.daemons[cast_.wild] = std::exchange(replaced_, nullptr);
    }
    for (std::size_t i = 0; i < plan_.owners; ++i) {
      const bool awaits = i == cast_.wild && replaced_;
      if (!cast_.daemons[i] || !cast_.daemons[i]->ended() || down_[i] > 0 || awaits) continue;
      ++run_.counts["daemon ended by itself"];
      cast_.daemons[i].reset();
      start_daemon(i);
    }
    timeline_.after(kLook, {"look"}, [this] { look_after(); });
  }

  void begin(const Fault& fault) {
    note(std::string("begin of ") + name_of(fault.kind) + " " + std::to_string(fault.target));
    ++run_.counts[std::string("fault ") + name_of(fault.kind)];
    switch (fault.kind) {
      case FaultKind::kStop:
        if (cast_.daemons[fault.target] && !cast_.daemons[fault.target]->paused()) {
          cast_.daemons[fault.target]->leave();
        }
        [[fallthrough]];
      case FaultKind::kKill:
      case FaultKind::kReconfigure:
      case FaultKind::kRename:
        take_down(fault.kind == FaultKind::kRename ? cast_.wild : fault.target,
                  fault.kind == FaultKind::kStop);
        break;
      case FaultKind::kReplace:
        if (!cast_.daemons[cast_.wild] || cast_.daemons[cast_.wild]->paused() || replaced_) break;
        cast_.daemons[cast_.wild]->pause();
        // Starts on another computer, which has no stored state of it.
        replaced_ = std::exchange(cast_.daemons[cast_.wild], nullptr);
        replaced_by_ = &fault;
        start_daemon(cast_.wild, nullptr);
        break;
      case FaultKind::kPause:
        if (cast_.daemons[fault.target]) {
          cast_.daemons[fault.target]->pause();
          hung_[&fault] = cast_.daemons[fault.target];
        }
        break;
      case FaultKind::kCut:
        network_.cut_in(fault.target, 1);
        [[fallthrough]];
      case FaultKind::kCutOneWay:
        network_.cut_out(fault.target, 1);
        break;
      case FaultKind::kPart:
        network_.part(fault.target, fault.other, 1);
        break;
      case FaultKind::kStepClock:
        offsets_[fault.target] += fault.step;
        break;
      case FaultKind::kFillDisk:
        disks_[fault.target].full = true;
        break;
    }
  }

  void end(const Fault& fault) {
    note(std::string("end of ") + name_of(fault.kind) + " " + std::to_string(fault.target));
    switch (fault.kind) {
      case FaultKind::kRename:
        ++cast_.renamed;
        bring_up(cast_.wild);
        break;
      case FaultKind::kReconfigure:
        cast_.has_extra[fault.target] = !cast_.has_extra[fault.target];
        [[fallthrough]];
      case FaultKind::kStop:
      case FaultKind::kKill:
        bring_up(fault.target);
        break;
      case FaultKind::kReplace:
        if (replaced_ && replaced_by_ == &fault) replaced_->resume();
        break;
      case FaultKind::kPause:
        if (const auto hung = hung_[&fault].lock()) hung->resume();
        break;
      case FaultKind::kCut:
        network_.cut_in(fault.target, -1);
        [[fallthrough]];
      case FaultKind::kCutOneWay:
        network_.cut_out(fault.target, -1);
        break;
      case FaultKind::kPart:
        network_.part(fault.target, fault.other, -1);
        break;
      case FaultKind::kStepClock:
        break;
      case FaultKind::kFillDisk:
        disks_[fault.target].full = false;
        break;
    }
  }

  // The last message of a stopping daemon is still sent.
  void take_down(std::size_t owner, bool gently) {
    ++down_[owner];
    if (owner == cast_.wild) replaced_.reset();
    if (!cast_.daemons[owner]) return;
    auto dying = std::exchange(cast_.daemons[owner], nullptr);
    if (gently) timeline_.after(milliseconds(5), {"end"}, [dying] {});
  }

  void bring_up(std::size_t owner) {
    if (--down_[owner] == 0 && !cast_.daemons[owner]) start_daemon(owner);
  }

  const Plan& plan_;
  const bool trace_;
  Timeline timeline_;
  Network network_;
  testing::Random random_;
  Invariants invariants_;
  Run run_;
  Surroundings surroundings_;
  Cast cast_;
  std::vector<Disk> disks_;  // the last is the renamed one's
  std::vector<milliseconds> offsets_;
  std::vector<int> down_;
  std::map<const Fault*, std::weak_ptr<Process>> hung_;
  std::shared_ptr<Process> replaced_;  // the wild daemon, while it hangs
  const Fault* replaced_by_ = nullptr;
  std::uint64_t processes_ = 0;
};

}  // namespace

Run run(const Plan& plan, bool trace) { return World(plan, trace).run(); }

}  // namespace tfdude::simulation
