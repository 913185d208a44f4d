#include "tf_import.hpp"

#include <algorithm>

#include "tfdude/base/id.hpp"

namespace tfdude::ros {
namespace {

using Kind = TfImport::Edit::Kind;

// A publisher that was silent for so long no longer decides about its frames.
constexpr std::chrono::seconds kSilent{1};

// Samples of one publisher that go back by more are from a clock that has jumped back. Late samples
// of one publisher are later than that only if it is slow beyond use.
constexpr std::chrono::seconds kJump{1};

// So many reports are remembered; what happens after that is only counted.
constexpr std::size_t kMaxReports = 1000;

// Static transforms that wait for a change of the structure; each change takes all of them again.
constexpr std::size_t kMaxHeldBack = 10'000;

void add_value(std::optional<Time> stamp, const EdgeUpdate& edge, TfImport::Changes& changes) {
  auto& batches = changes.batches;
  std::size_t& last = changes.last_batches[edge.id];
  if (batches.empty() || batches.back().stamp != stamp || last == batches.size()) {
    batches.push_back({stamp, {}});
  }
  batches.back().edges.push_back(edge);
  last = batches.size();
}

bool equal(const Pose& a, const Pose& b) {
  return a.translation() == b.translation() && a.rotation().coeffs() == b.rotation().coeffs();
}

}  // namespace

TfImport::Changes TfImport::take(const TfMessage& message, const std::string& writer,
                                 bool is_static, SteadyTime now, const WhoHolds& who_holds,
                                 std::optional<Time> arrival) {
  Changes changes;
  for (const TransformStamped& transform : message) {
    take_one(transform, writer, is_static, now, who_holds, arrival, changes);
  }
  return changes;
}

TfImport::Changes TfImport::retry(SteadyTime now, const WhoHolds& who_holds) {
  Changes changes;
  for (const auto& [name, held] : std::exchange(held_back_, {})) {
    take_one(held.transform, held.writer, true, now, who_holds, std::nullopt, changes);
  }
  return changes;
}

std::vector<std::string> TfImport::give_up(std::set<std::string> frames) {
  given_up_ = std::move(frames);
  std::vector<std::string> taken;
  for (const std::string& id : given_up_) {
    const auto entry = entries_.find(id);
    if (entry == entries_.end()) continue;
    if (entry->second.exists) taken.push_back(id);
    entries_.erase(entry);
  }
  return taken;
}

Holding TfImport::holding(const std::string& id, const WhoHolds& who_holds) const {
  Holding holding = who_holds(id);
  if (holding.kind == Holding::Kind::kOther || given_up_.count(id) == 0) return holding;
  return {Holding::Kind::kUnknown, "it is one of the robot's description"};
}

std::optional<std::string> TfImport::rejected(const std::string& id, const Error& error) {
  ++counts_.rejected;
  const std::string who = "frame " + quote(id);
  entries_.erase(id);
  if (!is_first("rejected " + id + std::string(tfdude::to_string(error.code)))) return std::nullopt;
  return "not taken: " + who + ": " + error.message;
}

std::optional<std::string> TfImport::rejected_sample(const std::string& id, const Error& error) {
  const std::string who = "frame " + quote(id);
  switch (error.code) {
    case Errc::kStampTaken:
      return stamps_.repeated(who, error.message);
    case Errc::kTooOld:
      return stamps_.old(who, error.message);
    case Errc::kInvalidInput:  // its numbers were checked
      return stamps_.early(who, error.message);
    default:
      return rejected(id, error);
  }
}

void TfImport::take_one(const TransformStamped& transform, const std::string& writer,
                        bool is_static, SteadyTime now, const WhoHolds& who_holds,
                        std::optional<Time> arrival, Changes& changes) {
  auto one = check(transform, is_static, changes);
  if (!one || joins(*one, changes) || !date(*one, arrival, changes)) return;
  const bool may =
      may_take(*one, writer, who_holds, changes) && has_parent(*one, who_holds, changes);
  if (!may) {
    ++counts_.owned;
    if (is_static) hold_back(*one, transform, writer, changes);
    return;
  }
  Entry& entry = entries_[one->id];
  if (!may_write(*one, writer, now, entry, changes)) return;
  apply(*one, writer, now, entry, changes);
  ++counts_.taken;
}

void TfImport::hold_back(const Checked& one, const TransformStamped& transform,
                         const std::string& writer, Changes& changes) {
  if (held_back_.size() >= kMaxHeldBack && held_back_.count(one.id) == 0) {
    return report_once("held back",
                       "not taken: more than " + std::to_string(kMaxHeldBack) +
                           " static transforms of frames of others",
                       changes);
  }
  TransformStamped held = transform;
  // The slashes before a name may be many.
  held.parent = without_slashes(transform.parent);
  held.child = without_slashes(transform.child);
  held_back_[one.id] = {std::move(held), writer};
}

std::optional<TfImport::Checked> TfImport::check(const TransformStamped& transform, bool is_static,
                                                 Changes& changes) {
  const std::string_view name = without_slashes(transform.child);
  const bool of_topic = transform.covariance.has_value();
  if (!of_topic && !settings_.frames.takes(name)) return std::nullopt;
  auto id = id_of(transform.child, settings_.prefix);
  auto parent = id_of(transform.parent, settings_.prefix);
  if (!id || !parent) {
    ++counts_.names;
    const std::string& why = id ? parent.error().message : id.error().message;
    report_once("name " + quote(transform.child) + quote(transform.parent), "not taken: " + why,
                changes);
    return std::nullopt;
  }
  const auto pose = pose_of(transform.pose);
  if (!pose || *id == *parent) {
    ++counts_.values;
    const std::string why = pose ? "it is its own parent" : pose.error().message;
    report_once("value " + *id, "not taken: frame " + quote(*id) + ": " + why, changes);
    return std::nullopt;
  }
  Transform X_PC{*pose, transform.covariance.value_or(settings_.covariance)};
  // Odometry begins where it says: that is what its frame is.
  if (!X_PC.covariance.complete() && drift_of(*id) != nullptr) {
    X_PC.covariance = StatedCovariance::exact();
  }
  const bool is_stamped = given_stamp(transform.stamp).has_value();
  return Checked{*std::move(id), *std::move(parent), X_PC,    transform.stamp,
                 is_static,      is_stamped,         of_topic};
}

bool TfImport::joins(const Checked& one, Changes& changes) {
  const auto entry = entries_.find(one.id);
  if (one.of_topic || entry == entries_.end() || !entry->second.of_topic) return false;
  ++counts_.joined;
  if (one.is_stamped && entry->second.parent == one.parent) extend(one.id, one.stamp, changes);
  return true;
}

void TfImport::extend(const std::string& id, Time stamp, Changes& changes) {
  const auto found = entries_.find(id);
  if (found == entries_.end() || !found->second.is_held() || stamp <= found->second.newest) return;
  found->second.newest = stamp;
  add_value(stamp, {id, {found->second.X_PC, {}}}, changes);
}

TfImport::Changes TfImport::hold(const TransformStamped& transform, SteadyTime now,
                                 const WhoHolds& who_holds) {
  Changes changes;
  const auto one = serve(transform, false, now, who_holds, changes);
  if (one) extend(one->id, one->stamp, changes);
  return changes;
}

TfImport::Changes TfImport::place(const TransformStamped& transform, SteadyTime now,
                                  const WhoHolds& who_holds) {
  Changes changes;
  (void)serve(transform, true, now, who_holds, changes);
  return changes;
}

std::optional<TfImport::Checked> TfImport::serve(const TransformStamped& transform, bool is_static,
                                                 SteadyTime now, const WhoHolds& who_holds,
                                                 Changes& changes) {
  TransformStamped given = transform;
  given.covariance = StatedCovariance::unspecified();
  auto one = check(given, is_static, changes);
  if (!one) return std::nullopt;
  const auto known = entries_.find(one->id);
  const bool is_observed = known != entries_.end() && known->second.observed;
  if (is_observed && known->second.parent == one->parent) return std::nullopt;
  if (!may_take(*one, {}, who_holds, changes) || !has_parent(*one, who_holds, changes)) {
    ++counts_.owned;
    return std::nullopt;
  }
  Entry& entry = entries_[one->id];
  changes.edits.push_back({entry.exists ? Kind::kMove : Kind::kAdd, one->id, one->parent,
                           Transform{one->X_PC.pose, {}}});
  entry = Entry();
  entry.exists = entry.of_topic = entry.observed = true;
  entry.parent = one->parent;
  entry.is_static = is_static;
  entry.heard = now;
  entry.X_PC = one->X_PC.pose;
  return one;
}

const Covariance* TfImport::drift_of(std::string_view id) const {
  const auto name = ros_name_of(id, settings_.prefix);
  const auto found = name ? settings_.drifts.find(*name) : settings_.drifts.end();
  return found == settings_.drifts.end() ? nullptr : &found->second;
}

std::optional<EdgeTiming> TfImport::timing_of(const std::string& id,
                                              const EdgeTiming& usual) const {
  const auto entry = entries_.find(id);
  const bool held = entry != entries_.end() && entry->second.is_held();
  const Covariance* density = drift_of(id);
  if (!held && density == nullptr) return std::nullopt;
  EdgeTiming timing = usual;
  timing.drifts = true;
  timing.moving = true;
  timing.process_noise = held ? Covariance() : *density;
  return timing;
}

bool TfImport::date(Checked& one, std::optional<Time> arrival, Changes& changes) {
  if (one.is_static || one.is_stamped) return true;
  const std::string who = "frame " + quote(one.id);
  const auto report = stamps_.unstamped(who, "taken as a sample of the time of its arrival");
  if (report) changes.reports.push_back(*report);
  one.stamp = arrival.value_or(Time());
  if (arrival) return true;
  ++counts_.timeless;
  report_once("timeless " + one.id, "not taken: " + who + ": the clock has no time yet", changes);
  return false;
}

bool TfImport::may_take(const Checked& one, const std::string& writer, const WhoHolds& who_holds,
                        Changes& changes) {
  if (entries_.count(one.id) != 0) return true;
  const Holding holding = this->holding(one.id, who_holds);
  switch (holding.kind) {
    case Holding::Kind::kOther:
      report_once("owned " + one.id + writer,
                  "not taken: frame " + quote(one.id) + " belongs to partition " +
                      quote(holding.who) + "; it is also published by the writer " + writer,
                  changes);
      return false;
    case Holding::Kind::kUnknown:
      report_once("unknown " + one.id,
                  "not taken for now: frame " + quote(one.id) + ": " + holding.who, changes);
      return false;
    case Holding::Kind::kBridge:
      entries_[one.id].exists = true;
      return true;
    default:
      return true;
  }
}

bool TfImport::has_parent(const Checked& one, const WhoHolds& who_holds, Changes& changes) {
  if (entries_.count(one.parent) != 0) return true;
  const Holding holding = this->holding(one.parent, who_holds);
  if (holding.kind == Holding::Kind::kUnknown) {
    report_once("unknown " + one.parent,
                "not taken for now: frame " + quote(one.parent) + ", the parent of " +
                    quote(one.id) + ": " + holding.who,
                changes);
    return false;
  }
  if (holding.kind == Holding::Kind::kOther) return true;
  if (holding.kind == Holding::Kind::kNobody) {
    changes.edits.push_back({Kind::kAddRoot, one.parent});
  }
  entries_[one.parent].exists = true;
  return true;
}

bool TfImport::may_write(const Checked& one, const std::string& writer, SteadyTime now,
                         Entry& entry, Changes& changes) {
  const bool takes_over = one.of_topic && !entry.of_topic;
  if (entry.writer.empty() || entry.writer == writer || takes_over) return true;
  const bool is_active = now - entry.heard < kSilent;
  const bool agrees = entry.parent == one.parent;
  // A static transform is published once, by nodes that may all be there.
  if ((is_active || one.is_static) && !std::exchange(entry.shared, true)) {
    report_once("shared " + one.id + entry.writer + writer,
                "frame " + quote(one.id) + " has two publishers: the writers " + entry.writer +
                    " (parent " + quote(entry.parent) + ") and " + writer + " (parent " +
                    quote(one.parent) + ")",
                changes);
  }
  if (agrees || one.is_static || !is_active) return true;
  ++counts_.contested;
  return false;
}

std::optional<Kind> TfImport::edit_for(const Checked& one, const Entry& entry, bool jumped) {
  // A frame that is the parent of others exists already, as a root.
  if (entry.parent.empty()) return entry.exists ? Kind::kMove : Kind::kAdd;
  if (entry.parent != one.parent || (one.is_static && !entry.is_static)) return Kind::kMove;
  return jumped ? std::optional<Kind>(Kind::kClear) : std::nullopt;
}

void TfImport::apply(const Checked& one, const std::string& writer, SteadyTime now, Entry& entry,
                     Changes& changes) {
  const bool decides = entry.writer == writer || now - entry.heard >= kSilent;
  const bool same_edge = !one.is_static && !entry.is_static && entry.parent == one.parent;
  // The partition cannot tell: of an edge that drifts it has the corrected pose.
  const bool is_repeat = same_edge && one.is_stamped && one.stamp == entry.newest &&
                         drift_of(one.id) != nullptr && equal(entry.X_PC, one.X_PC.pose);
  if (is_repeat) return stamps_.same();
  const bool jumped = same_edge && decides && entry.newest - one.stamp > kJump;
  if (jumped) report_jump(one, entry.newest, now, changes);
  // The samples of /tf at these instants have no covariance.
  const bool takes_over = same_edge && one.of_topic && !entry.of_topic;
  const auto edit = edit_for(one, entry, jumped || takes_over);
  if (edit) changes.edits.push_back({*edit, one.id, one.parent, one.X_PC});
  if (jumped) end_hold(one.parent, changes);
  if (!one.is_static) {
    // While the clock stands still, the sample before is replaced.
    const bool replaces = !one.is_stamped && !edit && !entry.is_static && one.stamp <= entry.newest;
    const auto stamp = replaces ? std::nullopt : std::optional<Time>(one.stamp);
    add_value(stamp, {one.id, one.X_PC}, changes);
    if (one.is_stamped) extend(one.parent, one.stamp, changes);
  } else if (!edit && !equal(entry.X_PC, one.X_PC.pose)) {
    add_value(std::nullopt, {one.id, one.X_PC}, changes);
  }
  entry.newest = edit ? one.stamp : std::max(entry.newest, one.stamp);
  entry.exists = true;
  entry.parent = one.parent;
  entry.is_static = one.is_static;
  entry.writer = writer;
  entry.heard = now;
  entry.X_PC = one.X_PC.pose;
  entry.of_topic = one.of_topic;
  entry.observed = false;
}

// What was found out about a held edge was so in the time before the jump.
void TfImport::end_hold(const std::string& id, Changes& changes) {
  const auto found = entries_.find(id);
  if (found == entries_.end() || !found->second.is_held()) return;
  found->second.newest = Time();
  changes.edits.push_back(
      {Kind::kMove, id, found->second.parent, Transform{found->second.X_PC, {}}});
}

// All frames of a bag jump at the same moment.
void TfImport::report_jump(const Checked& one, Time newest, SteadyTime now, Changes& changes) {
  if (jump_reported_ && now - *jump_reported_ < kSilent) return;
  jump_reported_ = now;
  changes.reports.push_back("frame " + quote(one.id) + ": time has jumped back from " +
                            readable(newest) + " to " + readable(one.stamp) +
                            "; its samples are dropped, and those of all frames that jump, too");
}

void TfImport::report_once(const std::string& about, std::string text, Changes& changes) {
  if (is_first(about)) changes.reports.push_back(std::move(text));
}

bool TfImport::is_first(const std::string& about) {
  return reported_.size() < kMaxReports && reported_.insert(about).second;
}

}  // namespace tfdude::ros
