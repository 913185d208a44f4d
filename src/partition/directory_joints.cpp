#include <algorithm>
#include <iterator>
#include <utility>

#include "tfdude/base/id.hpp"

#include "partition/directory.hpp"

// Which partitions the positions of a joint go to.
namespace tfdude {
namespace {

std::vector<Owner> distinct(const std::multiset<Owner>& owners) {
  std::vector<Owner> all;
  std::unique_copy(owners.begin(), owners.end(), std::back_inserter(all));
  return all;
}

}  // namespace

void Directory::put_own_joint(const PageJoint& joint) {
  add_joint(joint, kHeldHere);
  report_contested(joint.name);
}

void Directory::erase_own_joint(const PageJoint& joint) {
  forget_joint(joint, kHeldHere);
  report_contested(joint.name);
}

void Directory::add_joint(const PageJoint& joint, Owner owner) {
  ++version_;
  JointUse& use = joints_[joint.name];
  (joint.follows.empty() ? use.movers : use.others).insert(owner);
  if (!joint.follows.empty()) joints_[joint.follows].others.insert(owner);
}

void Directory::forget_joint(const PageJoint& joint, Owner owner) {
  ++version_;
  const bool moves = joint.follows.empty();
  forget_use(joint.name, moves ? &JointUse::movers : &JointUse::others, owner);
  if (!moves) forget_use(joint.follows, &JointUse::others, owner);
}

void Directory::forget_use(const std::string& name, std::multiset<Owner> JointUse::*part,
                           Owner owner) {
  const auto known = joints_.find(name);
  if (known == joints_.end()) return;
  auto& owners = known->second.*part;
  if (const auto one = owners.find(owner); one != owners.end()) owners.erase(one);
  if (known->second.movers.empty() && known->second.others.empty()) joints_.erase(known);
}

void Directory::replace_joints(KeptPage& kept, const std::vector<PageJoint>& joints, Owner owner) {
  if (kept.joints == joints) return;
  const std::vector<PageJoint> before = std::exchange(kept.joints, joints);
  for (const PageJoint& joint : before) forget_joint(joint, owner);
  for (const PageJoint& joint : joints) add_joint(joint, owner);
  for (const auto* changed : {&before, &joints}) {
    for (const PageJoint& joint : *changed) report_contested(joint.name);
  }
}

bool Directory::has_frames(Owner owner) const {
  if (owner == kHeldHere || reachable(owner)) return true;
  const auto frames = forest_.frames();
  return std::any_of(frames.begin(), frames.end(),
                     [owner](const FrameInfo& frame) { return frame.owner == owner; });
}

// A lost partition has no joints any more, either, if others own all its frames.
std::vector<Owner> Directory::living(const std::multiset<Owner>& owners) const {
  std::vector<Owner> all = distinct(owners);
  if (all.size() < 2) return all;
  all.erase(
      std::remove_if(all.begin(), all.end(), [this](Owner owner) { return !has_frames(owner); }),
      all.end());
  return all;
}

// With it moves a joint of its own that mimics one of these, of which it cannot be known.
std::optional<Owner> Directory::mimicker_of(const JointUse& use) {
  const auto other = std::find_if(use.others.begin(), use.others.end(),
                                  [&](Owner owner) { return use.movers.count(owner) == 0; });
  return other != use.others.end() ? std::optional(*other) : std::nullopt;
}

// "partitions 'arm' and 'base' have a joint 'elbow': say 'arm/elbow' or 'base/elbow'", unless that
// would be rejected.
std::string Directory::contested_text(const std::string& joint, const JointUse& use,
                                      const std::vector<Owner>& owners) const {
  std::vector<std::string> names;
  names.reserve(owners.size());
  for (const Owner owner : owners) names.push_back(name(owner));
  std::sort(names.begin(), names.end());
  std::string partitions;
  std::string scoped;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const bool last = i + 1 == names.size();
    const char* comma = i == 0 ? "" : ", ";
    partitions += (i > 0 && last ? " and " : comma) + quote(names[i]);
    scoped += (i > 0 && last ? " or " : comma) + quote(names[i] + "/" + joint);
  }
  const std::string contested = "partitions " + partitions + " have a joint " + quote(joint);
  const auto mimicker = mimicker_of(use);
  if (!mimicker) return contested + ": say " + scoped;
  return contested + ", and a joint of " + quote(name(*mimicker)) +
         " mimics one of them: give them different names";
}

// Each pair of partitions once, until the conflict has ended.
void Directory::report_contested(const std::string& joint) {
  const auto use = joints_.find(joint);
  const std::vector<Owner> movers =
      use == joints_.end() ? std::vector<Owner>() : living(use->second.movers);
  if (movers.size() < 2) {
    contested_joints_.erase(joint);
    return;
  }
  std::set<Owner>& reported = contested_joints_[joint];
  const bool known = std::includes(reported.begin(), reported.end(), movers.begin(), movers.end());
  reported = std::set<Owner>(movers.begin(), movers.end());
  // Owners concerned are informed in any case. The own partition has the least number.
  if (known || !(changes_.watched() || movers.front() == kHeldHere)) return;
  Change change{ChangeKind::kJointConflict, name(movers[0]), {}, {}, name(movers[1]), {}, {}};
  if (change.rival < change.partition) std::swap(change.partition, change.rival);
  change.joint = joint;
  change.message = contested_text(joint, use->second, movers);
  changes_.add(std::move(change));
}

Result<Directory::JointRoute> Directory::route_joint(const std::string& name) const {
  if (const auto known = joints_.find(name); known != joints_.end()) {
    const JointUse& use = known->second;
    if (const auto movers = living(use.movers); movers.size() > 1) {
      return fail(Errc::kAmbiguousJoint, contested_text(name, use, movers));
    }
    std::multiset<Owner> all = use.movers;
    all.insert(use.others.begin(), use.others.end());
    auto owners = living(all);
    return JointRoute{name, owners.empty() ? distinct(all) : std::move(owners)};
  }
  // Names of partitions may contain slashes, too.
  for (std::size_t at = name.find('/'); at != std::string::npos; at = name.find('/', at + 1)) {
    const auto owner = this->owner(std::string_view(name).substr(0, at));
    if (!owner) continue;
    auto route = route_joint_of(*owner, name.substr(at + 1));
    if (route || route.error().code != Errc::kUnknownJoint) return route;
  }
  return fail(Errc::kUnknownJoint, "no joint " + quote(name));
}

// Those that follow it move with it, unless it cannot be known which joint of this name they
// follow.
Result<Directory::JointRoute> Directory::route_joint_of(Owner owner,
                                                        const std::string& name) const {
  const auto known = joints_.find(name);
  if (known == joints_.end() || known->second.movers.count(owner) == 0) {
    return fail(Errc::kUnknownJoint, "no joint " + quote(name));
  }
  const JointUse& use = known->second;
  const auto movers = living(use.movers);
  JointRoute route{name, {owner}};
  if (movers.size() > 1) {
    if (!mimicker_of(use)) return route;
    return fail(Errc::kAmbiguousJoint, contested_text(name, use, movers));
  }
  for (const Owner other : living(use.others)) {
    if (other != owner) route.owners.push_back(other);
  }
  return route;
}

}  // namespace tfdude
