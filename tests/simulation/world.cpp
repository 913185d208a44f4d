#include "simulation/world.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

namespace tfdude::simulation {
namespace {

using faults::base_edge;
using faults::base_of;
using faults::partition_name;

// The frame that a configuration may have besides the base.
std::string extra_of(std::size_t owner) { return "extra_" + std::to_string(owner); }

constexpr Instant kLook = milliseconds(20);
// Longer than anything takes: that somebody counts as gone, is met again, has claimed its name and has conceded.
constexpr Instant kRest = milliseconds(12000);

class World {
 public:
  World(const Plan& plan, bool trace)
      : plan_(plan),
        trace_(trace),
        timeline_(plan.seed),
        network_(timeline_, plan),
        random_(plan.seed ^ 0x776f726cU),
        surroundings_{timeline_,
                      network_,
                      plan_,
                      random_,
                      [this](const std::string& step) { note(step); },
                      [this](const std::string& what) { violation(what); },
                      [this](const std::string& what) { ++run_.counts[what]; }},
        daemons_(plan.owners),
        wild_(plan.owners - 1),
        disks_(plan.owners + 1),
        offsets_(plan.owners),
        has_extra_(plan.owners, false),
        down_(plan.owners, 0) {}

  Run run() {
    for (std::size_t i = 0; i < plan_.owners; ++i) start_daemon(i);
    for (std::size_t i = 0; i < plan_.clients; ++i) start_author(i);
    for (std::size_t i = 0; i < plan_.followers; ++i) start_follower(i);
    for (const Fault& fault : plan_.faults) {
      timeline_.at(fault.begin, [this, &fault] { begin(fault); });
      timeline_.at(fault.end, [this, &fault] { end(fault); });
    }
    look_after();
    advance(plan_.storm);
    for (const auto& author : authors_) author->stop();
    for (const auto& follower : followers_) follower->stop();
    network_.set_loss(plan_.loss_after);
    if (plan_.lost < plan_.owners) take_down(plan_.lost, false);
    advance(plan_.storm + kRest);
    check();
    for (const auto& author : authors_) {
      for (const auto& [what, count] : author->outcomes()) run_.counts[what] += count;
    }
    for (const auto& follower : followers_) {
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

  void note(const std::string& step) {
    std::uint64_t hash = run_.hashes.empty() ? 14695981039346656037ULL : run_.hashes.back();
    const std::string line = std::to_string(timeline_.now().count()) + " " + step;
    for (const char c : line) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
    run_.hashes.push_back(hash);
    if (trace_)
      std::printf("%12.3f ms  %s\n",
                  std::chrono::duration<double, std::milli>(timeline_.now()).count(), step.c_str());
  }

  void violation(const std::string& what) {
    note("VIOLATION " + what);
    if (run_.violations.size() < 10) {
      run_.violations.push_back(std::to_string(timeline_.now().count() / 1'000'000) +
                                " ms: " + what);
    }
  }

  [[nodiscard]] std::string name_of_daemon(std::size_t owner) const {
    return owner == wild_ && renamed_ % 2 == 1 ? "renamed" : partition_name(owner);
  }
  [[nodiscard]] Disk* disk_of(std::size_t owner) {
    if (!(owner == wild_ ? plan_.wild_stores : plan_.stores)) return nullptr;
    return &disks_[name_of_daemon(owner) == "renamed" ? plan_.owners : owner];
  }

  void start_daemon(std::size_t owner) { start_daemon(owner, disk_of(owner)); }

  void start_daemon(std::size_t owner, Disk* disk) {
    Process::Setting setting;
    setting.host = owner;
    setting.id = ++processes_;
    setting.partition = name_of_daemon(owner);
    if (owner == 0) setting.configured.push_back({"world", "", {}});
    setting.configured.push_back({base_of(owner), "world", base_edge(owner)});
    if (has_extra_[owner]) setting.configured.push_back({extra_of(owner), base_of(owner), {}});
    setting.disk = disk;
    setting.clock_offset = &offsets_[owner];
    daemons_[owner] = std::make_shared<Process>(surroundings_, setting);
    network_.join(daemons_[owner]);
    note("start of " + setting.partition);
    daemons_[owner]->start();
  }

  void start_author(std::size_t number) {
    Process::Setting setting;
    setting.host = plan_.owners + number;
    setting.id = ++processes_;
    auto process = std::make_shared<Process>(surroundings_, setting);
    network_.join(process);
    process->start();
    authors_.push_back(std::make_shared<Author>(process, number, wild_, plan_.seed * 31 + number));
    authors_.back()->start();
  }

  void start_follower(std::size_t number) {
    Process::Setting setting;
    setting.host = plan_.owners + plan_.clients + number;
    setting.id = ++processes_;
    auto process = std::make_shared<Process>(surroundings_, setting);
    network_.join(process);
    process->start();
    followers_.push_back(
        std::make_shared<Follower>(process, number, wild_, plan_.seed * 37 + number));
    followers_.back()->start();
  }

  // Of one that hung and the one in its place, one goes on. Other daemons that have ended are started again.
  void look_after() {
    if (replaced_ && replaced_->ended()) replaced_.reset();
    if (replaced_ && !replaced_->paused() && daemons_[wild_] && daemons_[wild_]->ended()) {
      daemons_[wild_] = std::exchange(replaced_, nullptr);
    }
    for (std::size_t i = 0; i < plan_.owners; ++i) {
      const bool awaits = i == wild_ && replaced_;
      if (!daemons_[i] || !daemons_[i]->ended() || down_[i] > 0 || awaits) continue;
      ++run_.counts["daemon ended by itself"];
      daemons_[i].reset();
      start_daemon(i);
    }
    timeline_.after(kLook, [this] { look_after(); });
  }

  void begin(const Fault& fault) {
    note(std::string("begin of ") + name_of(fault.kind) + " " + std::to_string(fault.target));
    ++run_.counts[std::string("fault ") + name_of(fault.kind)];
    switch (fault.kind) {
      case FaultKind::kStop:
        if (daemons_[fault.target] && !daemons_[fault.target]->paused()) {
          daemons_[fault.target]->leave();
        }
        [[fallthrough]];
      case FaultKind::kKill:
      case FaultKind::kReconfigure:
      case FaultKind::kRename:
        take_down(fault.kind == FaultKind::kRename ? wild_ : fault.target,
                  fault.kind == FaultKind::kStop);
        break;
      case FaultKind::kReplace:
        if (!daemons_[wild_] || daemons_[wild_]->paused() || replaced_) break;
        daemons_[wild_]->pause();
        // On another computer, which has nothing of it.
        replaced_ = std::exchange(daemons_[wild_], nullptr);
        replaced_by_ = &fault;
        start_daemon(wild_, nullptr);
        break;
      case FaultKind::kPause:
        if (daemons_[fault.target]) {
          daemons_[fault.target]->pause();
          hung_[&fault] = daemons_[fault.target];
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
        ++renamed_;
        bring_up(wild_);
        break;
      case FaultKind::kReconfigure:
        has_extra_[fault.target] = !has_extra_[fault.target];
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

  // The last word of one who stops is still sent.
  void take_down(std::size_t owner, bool gently) {
    ++down_[owner];
    if (owner == wild_) replaced_.reset();
    if (!daemons_[owner]) return;
    auto dying = std::exchange(daemons_[owner], nullptr);
    if (gently) timeline_.after(milliseconds(5), [dying] {});
  }

  void bring_up(std::size_t owner) {
    if (--down_[owner] == 0 && !daemons_[owner]) start_daemon(owner);
  }

  // ---- what must be true

  [[nodiscard]] bool serves(const std::string& partition) const {
    return std::any_of(daemons_.begin(), daemons_.end(), [&](const auto& daemon) {
      return daemon && daemon->partition() == partition;
    });
  }

  void check() {
    std::vector<Process*> all;
    for (const auto& daemon : daemons_) {
      if (daemon) all.push_back(daemon.get());
    }
    std::vector<Author*> authors;
    for (const auto& author : authors_) {
      if (!passes_over_one(author->process())) authors.push_back(author.get());
    }
    for (Author* author : authors) all.push_back(&author->process());
    const auto expected = all.back()->structure();
    for (Process* one : all) {
      const std::string who = one->partition().empty() ? "a client" : one->partition();
      if (!one->partition().empty() && !one->serves()) violation(who + " does not serve");
      if (one->structure() != expected) {
        violation(who + " sees " + difference(one->structure(), expected));
      }
      if (!one->member().concessions().empty()) violation(who + " has something to concede");
      for (const PartitionInfo& partition : one->directory().partitions()) {
        if (partition.reachable != serves(partition.name)) {
          violation(who + (partition.reachable ? " still hears " : " misses ") + partition.name);
        }
      }
    }
    check_owners(*all.back());
    if (replaced_) violation("one that was replaced serves on");
    for (Author* author : authors) check_author(*author);
    for (const auto& follower : followers_) check_follower(*follower);
  }

  // A process without a file whose clock is behind that of its predecessor is not heard by a client that has met that one: a
  // client cannot tell it, and no daemon may be left that could.
  [[nodiscard]] bool passes_over_one(Process& client) {
    for (std::size_t i = 0; i < plan_.owners; ++i) {
      if (disk_of(i) != nullptr || !daemons_[i]) continue;
      const std::uint64_t met = client.directory().latest_incarnation(daemons_[i]->partition());
      if (met > daemons_[i]->member().presence().incarnation) return true;
    }
    return false;
  }

  // Long after the last write it shows what the owners have.
  void check_follower(Follower& follower) {
    Process* const owner = find_daemon(follower.partition());
    const auto arm = owner ? owner->forest().info(follower.arm()) : std::nullopt;
    if (!follower.watches() || !arm) return;
    Process& process = follower.process();
    const auto base = process.forest().info(arm->parent);
    Process* const below = base ? find_daemon(process.directory().name(base->owner)) : nullptr;
    if (below == nullptr || base->parent != "world") return;
    const auto X_WB = below->forest().lookup("world", base->id);
    const auto X_BT = owner->forest().lookup(base->id, follower.tip());
    if (!X_WB || !X_BT) return;
    ++run_.counts["watched paths checked"];
    const auto seen = follower.read();
    if (!seen) {
      violation(follower.tip() + " is not seen: " + seen.error().message);
    } else if (((X_WB->pose * X_BT->pose).translation() - seen->pose.translation()).norm() > 1e-9) {
      violation(follower.tip() + " is not seen where it is");
    }
  }

  [[nodiscard]] Process* find_daemon(const std::string& partition) const {
    for (const auto& daemon : daemons_) {
      if (daemon && daemon->partition() == partition) return daemon.get();
    }
    return nullptr;
  }

  // Of a frame that one serves who is there, it is the owner; who is not there has none of the configured frames.
  void check_owners(Process& one) {
    for (std::size_t i = 0; i < plan_.owners; ++i) {
      if (i == plan_.lost) continue;
      const auto frame = one.forest().info(base_of(i));
      const std::string owner = frame ? one.directory().name(frame->owner) : "nobody";
      if (owner != name_of_daemon(i)) violation(base_of(i) + " is of " + owner);
      const auto extra = one.forest().info(extra_of(i));
      if (extra && !has_extra_[i] && is_left_over(*extra, one)) continue;
      if (extra.has_value() != has_extra_[i]) {
        violation(extra_of(i) + (extra ? " is there" : " is missing"));
      } else if (extra && one.directory().name(extra->owner) != name_of_daemon(i)) {
        violation(extra_of(i) + " is of " + one.directory().name(extra->owner));
      }
    }
  }

  // Who goes on under another name knows nothing of what it had under the former, by which nobody is there.
  [[nodiscard]] bool is_left_over(const FrameInfo& frame, Process& seen_by) const {
    return !serves(seen_by.directory().name(frame.owner));
  }

  // Whether it hangs below a root, and not below a frame that was removed: such trees the model does not know.
  static bool stands(Process& process, FrameInfo frame) {
    while (!frame.parent.empty()) {
      const auto parent = process.forest().info(frame.parent);
      if (!parent) return false;
      frame = *parent;
    }
    return true;
  }

  void check_author(Author& author) {
    Process& process = author.process();
    for (const auto* models : {&author.model().frames(), &author.model().removed()}) {
      for (const auto& [id, model] : *models) {
        if (!serves(model.partition)) continue;
        const auto there = process.forest().info(id);
        // Nobody is left who could tell its owner that it is removed.
        const bool untold = std::any_of(model.removed_by.begin(), model.removed_by.end(),
                                        [&](const auto& one) { return !serves(one); });
        if (there && untold && !model.may_be_there()) continue;
        Frame seen;
        if (there) {
          seen = {id, there->parent, process.directory().name(there->owner), there->attached};
        }
        const std::string wrong = faults::misplaced(id, model, there ? &seen : nullptr);
        if (!wrong.empty()) violation(wrong);
      }
    }
    if (!run_.violations.empty()) return;
    // Before the lookups, which change the model.
    std::vector<std::pair<std::string, std::string>> edges;
    for (const auto& [id, model] : author.model().frames()) {
      const auto frame = process.forest().info(id);
      if (frame && serves(model.partition) && stands(process, *frame))
        edges.emplace_back(frame->parent, id);
    }
    for (const auto& [parent, id] : edges) author.look_up(parent, id, true);
    advance(timeline_.now() + 2 * Operation::kTimeout);
    run_.counts["values checked"] += edges.size();
  }

  static std::string difference(const std::vector<std::string>& a,
                                const std::vector<std::string>& b) {
    std::string text;
    for (const std::string& line : a) {
      if (!std::binary_search(b.begin(), b.end(), line)) text += " [" + line + "]";
    }
    text += ", and others";
    for (const std::string& line : b) {
      if (!std::binary_search(a.begin(), a.end(), line)) text += " [" + line + "]";
    }
    return text;
  }

  const Plan& plan_;
  const bool trace_;
  Timeline timeline_;
  Network network_;
  testing::Random random_;
  Surroundings surroundings_;
  std::vector<std::shared_ptr<Process>> daemons_;
  const std::size_t wild_;   // the last owner, which may be renamed and replaced
  std::vector<Disk> disks_;  // the last is the renamed one's
  std::vector<milliseconds> offsets_;
  std::vector<bool> has_extra_;  // by owner, whether its configuration has one frame more
  std::vector<int> down_;
  std::vector<std::shared_ptr<Author>> authors_;
  std::vector<std::shared_ptr<Follower>> followers_;
  std::map<const Fault*, std::weak_ptr<Process>> hung_;
  std::shared_ptr<Process> replaced_;  // the wild one, while it hangs
  const Fault* replaced_by_ = nullptr;
  std::uint64_t processes_ = 0;
  int renamed_ = 0;
  Run run_;
};

}  // namespace

Run run(const Plan& plan, bool trace) { return World(plan, trace).run(); }

}  // namespace tfdude::simulation
