#include "partition/joints.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/base/number.hpp"

namespace tfdude {
namespace {

// The error that the edge shares with those of coupled joints: the error of one number.
Correlation shared_error(const JointSpec& spec, std::optional<double> variance) {
  if (variance.value_or(0) == 0) return {};
  Loading loading = spec.joint.S * std::sqrt(*variance);
  // The sign of the leader's error.
  if (spec.mimic && spec.mimic->multiplier < 0) loading = -loading;
  return {false, {{shared_source(leader_of(spec)), false, std::move(loading)}}, {}};
}

Error beyond_limits(const JointSpec& spec, double position) {
  constexpr int kDigits = 12;
  return {Errc::kInvalidInput, "joint " + quote(spec.name) + ": position " +
                                   number_text(position, kDigits) + " is outside its limits, " +
                                   number_text(spec.limits->lower, kDigits) + " to " +
                                   number_text(spec.limits->upper, kDigits)};
}

}  // namespace

Result<void> check_joints(const std::vector<FrameSpec>& frames) {
  for (const FrameSpec& frame : frames) {
    if (!frame.joint) continue;
    if (auto ok = check_joint(*frame.joint); !ok) {
      return fail_at("frame " + quote(frame.id), ok.error());
    }
  }
  return {};
}

Transform value_of(const FrameSpec& frame) {
  const auto& joint = frame.joint;
  return joint ? value_at(*joint, joint->position, joint->variance) : frame.X_PC;
}

PageJoint names_of(const JointSpec& joint) {
  return {joint.name, joint.mimic ? joint.mimic->joint : ""};
}

std::map<std::string, PageJoint> joints_of(const std::vector<FrameSpec>& frames) {
  std::map<std::string, PageJoint> joints;
  for (const FrameSpec& frame : frames) {
    if (frame.joint) joints.emplace(frame.id, names_of(*frame.joint));
  }
  return joints;
}

std::optional<StoredJoint> left_of(const JointSpec& joint, const std::vector<StoredJoint>& left) {
  const auto named = [&](const std::string& name) {
    return std::find_if(left.begin(), left.end(),
                        [&](const StoredJoint& one) { return one.name == name; });
  };
  if (const auto leader = joint.mimic ? named(joint.mimic->joint) : left.end();
      leader != left.end()) {
    return StoredJoint{joint.name, joint.mimic->position(leader->position),
                       joint.mimic->variance(leader->variance), joint.type};
  }
  const auto own = named(joint.name);
  return own != left.end() ? std::optional<StoredJoint>(*own) : std::nullopt;
}

void Joints::put(const std::string& frame, const JointSpec& joint,
                 const std::optional<StoredJoint>& left) {
  const auto handle = forest_.find(frame);
  if (!handle || !forest_.holds(frame)) return;
  Mover mover{frame, *handle, joint, joint.position, joint.variance};
  if (left) {
    mover.position = left->position;
    mover.variance = left->variance;
    mover.measured = true;
    // The limits may have been narrowed since.
    mover.outside = joint.limits && !joint.limits->contain(mover.position) ? 1 : 0;
  }
  if (joint.coupled) {
    mover.said = shared_error(joint, mover.variance);
    mover.said_variance = mover.variance;
    // Setting it again would drop what observations have left, which an earlier process may have
    // stored.
    const auto kept = forest_.kept(frame);
    if (kept && !(kept->correlation.said == mover.said)) (void)forest_.correlate(frame, mover.said);
  }
  by_name_[joint.name];
  by_name_[leader_of(joint)].push_back(movers_.size());
  movers_.push_back(std::move(mover));
}

void Joints::detach_joint(const std::string& frame) {
  for (Mover& mover : movers_) {
    if (mover.frame == frame) detach(mover);
  }
}

// Its stored position would grow old, while those of joints that follow it are kept up to date.
void Joints::detach(Mover& mover) {
  if (!std::exchange(mover.detached, true)) erased_.insert(mover.spec.name);
}

bool Joints::is_coupled(std::string_view frame) const {
  return std::any_of(movers_.begin(), movers_.end(), [frame](const Mover& mover) {
    return mover.spec.coupled && !mover.detached && mover.frame == frame;
  });
}

// For removed frames; another frame with that id is a different one.
void Joints::forget_removed() {
  for (Mover& mover : movers_) {
    if (!forest_.info(mover.handle)) detach(mover);
  }
}

Result<void> Joints::plan(const JointValue& value) {
  const auto found = by_name_.find(value.name);
  if (found == by_name_.end()) return {};
  if (auto ok = check_value(value); !ok) return ok;
  for (const std::size_t index : found->second) {
    Mover& mover = movers_[index];
    if (mover.detached) continue;
    const JointSpec& spec = mover.spec;
    const Mimic mimic = spec.mimic.value_or(Mimic{});
    Step step{index, mimic.position(value.position),
              value.variance ? mimic.variance(value.variance) : spec.sample_variance};
    if (!is_position(step.position) || (step.variance && !is_variance(*step.variance))) {
      return check_value({spec.name, step.position, step.variance});
    }
    if (std::exchange(mover.planned, plans_) == plans_) {
      return fail(Errc::kInvalidInput, "joint " + quote(value.name) + " is named twice");
    }
    step.outside = spec.limits && !spec.limits->contain(step.position);
    if (step.outside && spec.strict) {
      ++mover.refused;
      return tl::unexpected(beyond_limits(spec, step.position));
    }
    steps_.push_back(step);
  }
  return {};
}

bool Joints::is_newer(const Mover& mover, std::optional<Time> stamp) {
  return !stamp || !mover.stamp || *mover.stamp < *stamp;
}

// Whether the edge's history has restarted, so that an older sample is its newest.
bool Joints::starts_again(const Mover& mover, Time stamp) const {
  const auto history = forest_.histories(mover.frame);
  return !history.empty() && history.front().newest == stamp;
}

void Joints::take(const Step& step, std::optional<Time> stamp) {
  Mover& mover = movers_[step.mover];
  mover.outside += step.outside ? 1 : 0;
  if (!is_newer(mover, stamp)) {
    if (!starts_again(mover, *stamp)) return;
    if (mover.spec.coupled && mover.said_variance != step.variance) {
      mover.said = shared_error(mover.spec, step.variance);
      (void)forest_.correlate(mover.frame, mover.said);
    }
  }
  mover.position = step.position;
  mover.variance = step.variance;
  if (mover.spec.coupled) mover.said_variance = step.variance;
  if (stamp) mover.stamp = stamp;
  mover.measured = true;
  mover.changed = true;
}

Result<std::size_t> Joints::apply(const JointUpdate& update) {
  steps_.clear();
  updates_.clear();
  ++plans_;
  for (const JointValue& value : update.joints) {
    if (auto ok = plan(value); !ok) return tl::unexpected(std::move(ok.error()));
  }
  if (steps_.empty()) return 0;
  for (const Step& step : steps_) {
    Mover& mover = movers_[step.mover];
    CorrelatedUpdate one{mover.handle, value_at(mover.spec, step.position, step.variance)};
    one.state = {&mover.spec.joint,
                 {step.position, own_variance(mover.spec, step.variance)},
                 period_of(mover.spec)};
    const bool resay = mover.spec.coupled && mover.said_variance != step.variance;
    if (resay && is_newer(mover, update.stamp)) {
      mover.said = shared_error(mover.spec, step.variance);
      one.correlation = &mover.said;
    }
    updates_.push_back(one);
  }
  auto updated = forest_.update_correlated(updates_, update.stamp);
  if (!updated && updated.error().code == Errc::kUnknownFrame) {
    forget_removed();
    return apply(update);
  }
  if (!updated) return tl::unexpected(std::move(updated.error()));
  for (const Step& step : steps_) take(step, update.stamp);
  return steps_.size();
}

void Joints::show(std::vector<JointInfo> joints) {
  shown_ = std::move(joints);
  std::sort(shown_.begin(), shown_.end(),
            [](const JointInfo& a, const JointInfo& b) { return a.name < b.name; });
}

std::vector<JointInfo> Joints::infos(std::string_view after) const {
  std::vector<JointInfo> infos;
  for (const JointInfo& joint : shown_) {
    if (joint.name > after && infos.size() < kMaxItems) infos.push_back(joint);
  }
  if (!shown_.empty()) return infos;
  for (const Mover& mover : movers_) {
    if (mover.spec.name <= after || mover.detached || !forest_.info(mover.handle)) continue;
    const JointSpec& spec = mover.spec;
    infos.push_back({spec.name, mover.frame, spec.type, spec.limits, spec.mimic, mover.position,
                     mover.variance, mover.measured, mover.outside, mover.refused});
  }
  std::sort(infos.begin(), infos.end(),
            [](const JointInfo& a, const JointInfo& b) { return a.name < b.name; });
  if (infos.size() > kMaxItems) infos.resize(kMaxItems);
  return infos;
}

void Joints::erase_unused(const std::vector<StoredJoint>& stored) {
  std::set<std::string_view> used;
  for (const Mover& mover : movers_) {
    if (mover.measured) used.insert(mover.spec.name);
  }
  for (const StoredJoint& joint : stored) {
    if (used.count(joint.name) == 0) erased_.insert(joint.name);
  }
}

// Two frames may have joints of one name.
std::vector<std::string> Joints::take_erased() {
  for (const Mover& mover : movers_) {
    if (!mover.detached && mover.measured) erased_.erase(mover.spec.name);
  }
  const std::set<std::string> erased = std::exchange(erased_, {});
  return {erased.begin(), erased.end()};
}

std::vector<StoredJoint> Joints::take_changed() {
  std::vector<StoredJoint> changed;
  for (Mover& mover : movers_) {
    if (!mover.changed || mover.detached) continue;
    changed.push_back({mover.spec.name, mover.position, mover.variance, mover.spec.type});
    mover.changed = false;
  }
  return changed;
}

void Joints::still_changed(const std::vector<StoredJoint>& joints) {
  for (const StoredJoint& joint : joints) {
    for (Mover& mover : movers_) mover.changed = mover.changed || mover.spec.name == joint.name;
  }
}

}  // namespace tfdude
