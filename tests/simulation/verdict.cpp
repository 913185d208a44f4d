#include "simulation/verdict.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "simulation/streamer.hpp"

namespace tfdude::simulation {
namespace {

using faults::base_of;

// A call asks a few times, and the replies to it are kept until the next one.
constexpr std::size_t kRepliesPerClient = 8;
constexpr milliseconds kStep{50};

std::string difference(const std::vector<std::string>& a, const std::vector<std::string>& b) {
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

// Whether the frame is below a root, and not below a removed frame: the model does not know such
// trees. A frame whose removal was confirmed may still seem to be there, if its owner is lost and
// told nobody else.
bool stands(Process& process, const faults::Model& model, FrameInfo frame) {
  while (!frame.parent.empty()) {
    const auto parent = process.forest().info(frame.parent);
    if (!parent || model.removed().count(frame.parent) != 0) return false;
    frame = *parent;
  }
  return true;
}

}  // namespace

void Verdict::violation(const std::string& kind, const std::string& what) {
  agreed_ = false;
  calls_.violation(kind, what);
}

void Verdict::check() {
  std::vector<Process*> all;
  for (std::size_t i = 0; i < plan_.owners; ++i) {
    const bool core = cast_.standings[i] == Cast::Standing::kCore;
    if (core && cast_.daemons[i]) all.push_back(cast_.daemons[i].get());
  }
  std::vector<Author*> authors;
  for (const auto& author : cast_.authors) {
    if (hears_all(author->process())) authors.push_back(author.get());
  }
  for (Author* author : authors) all.push_back(&author->process());
  const auto expected = structure_of(*all.back());
  for (Process* one : all) check_replica(*one, expected);
  for (Process* one : all) {
    for (const std::string& partition : forgotten()) check_forgotten(*one, partition);
  }
  check_owners(*all.back());
  check_handed(*all.back());
  for (Author* author : authors) check_author(*author);
  if (agreed_) {
    for (Author* author : authors) look_up_all(*author);
  }
  for (const auto& follower : cast_.followers) check_follower(*follower);
  check_samplers();
  for (const auto& streamer : cast_.streamers) {
    if (hears_all(streamer->process())) streamer->check(cast_);
  }
  await_calls();
  const auto add = [&](Process& process) {
    const bool is_new = std::find(all.begin(), all.end(), &process) == all.end();
    if (is_new && hears_all(process)) all.push_back(&process);
  };
  for (const auto& actor : cast_.actors) add(actor->process());
  for (const auto& streamer : cast_.streamers) add(streamer->process());
  for (Process* one : all) check_kept(*one);
}

// Nothing grows: what is kept is bounded by what the run did, and what served calls, watches and
// silences that are over is gone.
void Verdict::check_kept(Process& one) {
  const std::string who = one.partition().empty() ? "a client" : one.partition();
  const auto grows = [&](const std::string& what) { violation("something grows", who + what); };
  if (one.open_calls() > 0) grows(" has " + std::to_string(one.open_calls()) + " open calls");
  for (const Absent& absent : one.directory().absent()) {
    if (cast_.standing(absent.partition) == Cast::Standing::kCore)
      grows(" has not forgotten the absence of " + absent.partition);
    if (absent.kind == Absent::Kind::kSilent) grows(" takes " + absent.partition + " for silent");
  }
  if (!one.partition().empty()) check_kept_by_owner(one);
}

void Verdict::check_kept_by_owner(Process& owner) {
  const auto grows = [&](const std::string& what) {
    violation("something grows", owner.partition() + what);
  };
  const Partition* partition = owner.member().partition();
  if (partition == nullptr) return;
  const std::size_t clients = plan_.actors();
  if (partition->kept_replies() > kRepliesPerClient * clients) {
    grows(" keeps " + std::to_string(partition->kept_replies()) + " replies");
  }
  std::map<std::string, std::string> listed;  // parents
  std::set<std::string> tombstones;
  for (const Sample& sample : owner.published()) {
    const auto* page = std::get_if<Page>(&sample);
    if (page == nullptr) continue;
    for (const PageEntry& entry : page->entries) listed.emplace(entry.id, entry.parent);
    for (const Tombstone& tombstone : page->tombstones) {
      if (tombstone.kind != Tombstone::Kind::kUnhung) tombstones.insert(tombstone.id);
    }
  }
  for (const auto& [id, parent] : listed) {
    const auto frame = owner.forest().info(id);
    if (frame && frame->owner == kHeldHere && frame->parent == parent) continue;
    violation("an owner's pages are not its frames",
              owner.partition() + " has published " + id + " under " + parent);
  }
  if (listed.size() + tombstones.size() > named_) {
    grows(" lists " + std::to_string(listed.size()) + " frames and " +
          std::to_string(tombstones.size()) + " tombstones of " + std::to_string(named_));
  }
  for (const std::string& id : tombstones) {
    if (listed.count(id) > 0) grows(" lists " + id + " and its tombstone");
  }
  std::set<std::uint64_t> watched;
  const auto watches = [&](Process& process) {
    const std::set<std::uint64_t>& opened = process.watches().opened();
    watched.insert(opened.begin(), opened.end());
  };
  for (const auto& follower : cast_.followers) watches(follower->process());
  for (const auto& sampler : cast_.samplers) watches(sampler->process());
  for (const std::uint64_t group : owner.pushed_groups()) {
    if (watched.count(group) == 0) grows(" pushes to a group that nobody watches");
  }
}

// A client cannot tell a partition that its pages were dropped: it has forgotten the partition, or
// they came from a process without a file whose clock is behind. They are not sent again.
bool Verdict::lacks_one(Process& client) const {
  const std::string* lacked = client.directory().incomplete();
  if (lacked == nullptr) return false;
  if (client.world().forgotten.count(*lacked) > 0) return !is_told_by_one(*lacked);
  for (std::size_t i = 0; i < plan_.owners; ++i) {
    if (cast_.name_of_daemon(i) == *lacked) return plan_.may_lack_state(i);
  }
  return false;
}

// Whether some daemon must have told a partition that it was last forgotten: that is in its file.
// Then the partition has continued as a later process, whose pages all get.
bool Verdict::is_told_by_one(const std::string& partition) const {
  if (cast_.standing(partition) != Cast::Standing::kCore) return false;
  const Author& author = *cast_.authors.front();
  const auto& by = author.world().forgotten_by;
  const auto who = by.find(partition);
  const auto last = author.world().forgotten.find(partition);
  if (last == author.world().forgotten.end()) return false;
  for (std::size_t i = 0; who != by.end() && i < plan_.owners; ++i) {
    const std::string name = cast_.name_of_daemon(i);
    const bool keeps = !plan_.may_lack_state(i) && !author.has_lost_power(name);
    const bool core = cast_.standings[i] == Cast::Standing::kCore;
    const auto stored = who->second.find(name);
    const bool told = stored != who->second.end() && stored->second.second >= last->second;
    if (core && keeps && told) return true;
  }
  return false;
}

void Verdict::check_replica(Process& one, const std::vector<std::string>& expected) {
  const std::string who = one.partition().empty() ? "a client" : one.partition();
  if (!one.partition().empty() && !one.serves()) {
    violation("a daemon does not serve", who);
  }
  const auto seen = structure_of(one);
  if (seen != expected) violation("replicas differ", who + " sees " + difference(seen, expected));
  if (!one.member().pending_yields().empty()) violation("a yield is pending", who);
  for (const auto& daemon : cast_.daemons) {
    if (!daemon || daemon.get() == &one) continue;
    if (cast_.standing(daemon->partition()) != Cast::Standing::kCore) continue;
    if (one.directory().serving(daemon->partition())) continue;
    violation("presences differ", who + " does not know " + daemon->partition());
  }
  for (const PartitionInfo& partition : one.directory().partitions()) {
    if (partition.reachable != cast_.serves(partition.name)) {
      violation("presences differ",
                who + (partition.reachable ? " still hears " : " misses ") + partition.name);
    }
  }
}

// With a full disk a partition cannot continue as a later process: those that have forgotten it do
// not hear it, the others do.
std::set<std::string> Verdict::cannot_return() const {
  std::set<std::string> names;
  for (const Fault& fault : plan_.lasting) {
    if (fault.kind != FaultKind::kFillDisk || fault.left_out) continue;
    const std::string name = cast_.name_of_daemon(fault.target);
    if (cast_.authors.front()->world().forgotten.count(name) > 0) names.insert(name);
  }
  return names;
}

// With a full disk an owner publishes no page any more: a frame that it has handed over stays on
// the last one. Who has not heard of the new owner, which may be gone, takes that for true.
bool Verdict::cannot_withdraw(const std::string& frame, const std::string& owner) const {
  const Process* daemon = cast_.find_daemon(owner);
  if (daemon == nullptr || cast_.standing(owner) != Cast::Standing::kAside) return false;
  return !daemon->forest().holds(frame);
}

std::vector<std::string> Verdict::structure_of(const Process& one) const {
  const auto out = cannot_return();
  return one.structure([&](const std::string& frame, const std::string& owner) {
    return out.count(owner) == 0 && !cannot_withdraw(frame, owner);
  });
}

// Those that were forgotten after their last process was heard.
std::vector<std::string> Verdict::forgotten() const {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < plan_.owners; ++i) {
    const std::string name = cast_.name_of_daemon(i);
    const bool out = plan_.forgets && cast_.standings[i] == Cast::Standing::kOut;
    if (out && cast_.authors.front()->has_forgotten(name, plan_.storm + kForgetAfter))
      names.push_back(name);
  }
  return names;
}

void Verdict::check_forgotten(Process& one, const std::string& partition) {
  const std::string who = one.partition().empty() ? "a client" : one.partition();
  for (const PartitionInfo& known : one.directory().partitions()) {
    if (known.name == partition)
      violation("a forgotten partition is known", who + " lists " + partition);
  }
  for (const FrameInfo& frame : one.forest().frames()) {
    if (one.directory().name(frame.owner) != partition) continue;
    violation("a forgotten partition is known", who + " sees " + frame.id + " of " + partition);
  }
}

// A process without a file whose clock is behind that of its predecessor is not heard by a client
// that has met that one: a client cannot tell it, and no daemon may be left that could.
bool Verdict::passes_over_one(Process& client) const {
  for (std::size_t i = 0; i < plan_.owners; ++i) {
    if (!plan_.may_lack_state(i) || !cast_.daemons[i]) continue;
    const std::uint64_t met = client.directory().latest_incarnation(cast_.daemons[i]->partition());
    if (met > cast_.daemons[i]->member().presence().incarnation) return true;
  }
  return false;
}

bool Verdict::hears_all(Process& client) const {
  return !passes_over_one(client) && !lacks_one(client);
}

Process* Verdict::find_core(const std::string& partition) const {
  const bool core = cast_.standing(partition) == Cast::Standing::kCore;
  return core ? cast_.find_daemon(partition) : nullptr;
}

// A root whose owner is down may have been forgotten with it.
bool Verdict::is_held(const std::string& frame) const {
  return std::any_of(cast_.daemons.begin(), cast_.daemons.end(), [&](const auto& daemon) {
    if (daemon == nullptr || find_core(daemon->partition()) != daemon.get()) return false;
    const auto known = daemon->forest().info(frame);
    return known && known->owner == kHeldHere;
  });
}

// Long after the last write it shows the values of the owners.
void Verdict::check_follower(Follower& follower) {
  Process* const owner = find_core(follower.partition());
  const auto arm = owner ? owner->forest().info(follower.arm()) : std::nullopt;
  Process& process = follower.process();
  if (!follower.watches() || !arm || !hears_all(process)) return;
  const auto base = process.forest().info(arm->parent);
  Process* const below = base ? find_core(process.directory().name(base->owner)) : nullptr;
  if (below == nullptr || base->parent != "world" || !is_held("world")) return;
  const auto X_WB = below->forest().lookup("world", base->id);
  const auto X_BT = owner->forest().lookup(base->id, follower.tip());
  if (!X_WB || !X_BT) return;
  calls_.count("watched paths checked", 1);
  const auto seen = follower.read();
  if (!seen) {
    violation("a watched path shows nothing", follower.tip() + ": " + seen.error().message);
  } else if (((X_WB->pose * X_BT->pose).translation() - seen->pose.translation()).norm() > 1e-9) {
    violation("a watched path shows an old value", follower.tip());
  }
}

// The owner still has each sample that it has taken.
void Verdict::check_samplers() {
  for (const auto& sampler : cast_.samplers) {
    Process* const owner = find_core(sampler->partition());
    const auto frame = owner ? owner->forest().info(sampler->frame()) : std::nullopt;
    const auto base = frame ? sampler->process().forest().info(frame->parent) : std::nullopt;
    if (!base || !hears_all(sampler->process())) continue;
    sampler->look_back();
    sampler->check_watch(owner->forest());
    calls_.count("sampled edges checked", 1);
  }
}

void Verdict::await_calls() {
  const auto open = [](const auto& actor) { return actor->process().open_calls() > 0; };
  for (Instant waited{0}; waited < 2 * RunningCall::kTimeout; waited += kStep) {
    calls_.wait(kStep);
    if (std::none_of(cast_.authors.begin(), cast_.authors.end(), open) &&
        std::none_of(cast_.samplers.begin(), cast_.samplers.end(), open)) {
      return;
    }
  }
}

// A reachable daemon owns the frame that it is configured with; an unreachable one owns none of the
// configured frames.
void Verdict::check_owners(Process& one) {
  for (std::size_t i = 0; i < plan_.owners; ++i) {
    if (cast_.standings[i] != Cast::Standing::kCore) continue;
    const auto frame = one.forest().info(base_of(i));
    const std::string owner = frame ? one.directory().name(frame->owner) : "nobody";
    if (owner != cast_.name_of_daemon(i)) {
      violation("a configured frame is another's", base_of(i) + " is of " + owner);
    }
    const auto extra = one.forest().info(extra_of(i));
    const Configured& configured = cast_.configured[i];
    if (extra && !configured.extra && is_left_over(*extra, one)) continue;
    if (extra.has_value() != configured.extra) {
      violation("a configuration does not hold",
                extra_of(i) + (extra ? " is there" : " is missing"));
    } else if (extra && extra->parent != extra_parent_of(i, configured, plan_.owners)) {
      violation("a configuration does not hold", extra_of(i) + " is below " + extra->parent);
    } else if (extra && one.directory().name(extra->owner) != cast_.name_of_daemon(i)) {
      violation("a configured frame is another's",
                extra_of(i) + " is of " + one.directory().name(extra->owner));
    }
  }
}

// What a deputy has removed does not return with the former owner, unless that one was forgotten:
// it joins as a new one.
void Verdict::check_handed(Process& one) {
  const auto& world = cast_.authors.front()->world();
  const bool forgotten = world.forgotten.count(faults::partition_name(cast_.wild)) != 0;
  if (!world.handed_removed || !plan_.deputizes_in_peace() || forgotten) return;
  calls_.count("a deputy's removal was checked", 1);
  if (one.forest().exists(kHanded)) violation("a removed frame is back", kHanded);
}

// A renamed daemon knows nothing of its frames under the former name, which no daemon serves.
bool Verdict::is_left_over(const FrameInfo& frame, Process& seen_by) const {
  return !cast_.serves(seen_by.directory().name(frame.owner));
}

void Verdict::check_author(Author& author) {
  Process& process = author.process();
  for (const auto* models : {&author.model().frames(), &author.model().removed()}) {
    for (const auto& [id, model] : *models) {
      if (!cast_.serves(model.partition)) continue;
      // With a full disk it cannot go on as a later process, after it was forgotten.
      const bool silent = !process.directory().serving(model.partition);
      if (silent && cast_.standing(model.partition) == Cast::Standing::kAside) continue;
      const auto there = process.forest().info(id);
      // Maybe no participant is left that could tell its owner about the removal, or it cannot be
      // stored.
      const auto cannot = [&](const std::string& one) {
        return cast_.standing(one) != Cast::Standing::kCore || author.has_lost_power(one);
      };
      const bool untold = cast_.standing(model.partition) != Cast::Standing::kCore ||
                          std::any_of(model.removed_by.begin(), model.removed_by.end(), cannot);
      if (there && untold && !model.may_be_there()) continue;
      Frame seen;
      if (there) {
        seen = {id, there->parent, process.directory().name(there->owner), there->attached};
      }
      const std::string wrong = faults::misplaced(id, model, there ? &seen : nullptr);
      if (!wrong.empty()) violation("an acknowledged change is lost", wrong);
    }
  }
}

void Verdict::look_up_all(Author& author) {
  Process& process = author.process();
  // Before the lookups, which change the model.
  std::vector<std::pair<std::string, std::string>> edges;
  for (const auto& [id, model] : author.model().frames()) {
    const auto frame = process.forest().info(id);
    if (frame && cast_.serves(model.partition) && stands(process, author.model(), *frame))
      edges.emplace_back(frame->parent, id);
  }
  for (const auto& [parent, id] : edges) author.look_up(parent, id, true);
  calls_.count("values checked", edges.size());
}

}  // namespace tfdude::simulation
