#include "faults/worker.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "support/process.hpp"

namespace tfdude::faults {
namespace {

// A client owns about this many frames at most.
constexpr std::size_t kFrames = 40;
constexpr std::size_t kJointsOfWorker = 3;
constexpr std::size_t kRemovedKept = 10;

std::string translation(const Transform& X) {
  const Eigen::Vector3d t = X.pose.translation();
  char text[64];
  std::snprintf(text, sizeof text, "(%.4f %.4f %.4f)", t.x(), t.y(), t.z());
  return text;
}

// Without rotation, so that a streamed value can be recognized.
Transform joint_value(std::uint32_t serial, std::size_t owner) {
  return {Pose::trusted(Eigen::Quaterniond::Identity(), {double(serial), double(owner), 0.5}), {}};
}

}  // namespace

Worker::Worker(Client client, std::size_t number, std::size_t partitions, std::uint64_t seed,
               Journal& journal)
    : client_(std::move(client)),
      prefix_("c" + std::to_string(number) + "_"),
      number_(number),
      partitions_(partitions),
      random_(seed),
      journal_(journal) {
  fix_bases(model_, partitions);
}

void Worker::start() {
  add_joints();
  thread_ = std::thread([this] { run(); });
}

void Worker::stop() {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
}

void Worker::add_joints() {
  for (std::size_t i = 0; i < kJointsOfWorker; ++i) {
    const std::string id = prefix_ + "joint_" + std::to_string(i);
    const std::string base = any_base();
    Result<void> added;
    if (!testing::eventually([&] {
          added = client_.add(id, base, joint_value(0, number_));
          return added || added.error().code == Errc::kAlreadyExists;
        })) {
      journal_.violation("no joint " + id + ": " + added.error().message);
    }
    joints_[id] = base;
  }
}

void Worker::run() {
  while (!stopping_) {
    calm_ = journal_.calm();
    step();
    // Leaves the machine time for the processes that answer.
    std::this_thread::sleep_for(std::chrono::microseconds(random_.index(4000)));
  }
}

void Worker::step() {
  struct Kind {
    std::size_t share;
    void (Worker::*run)();
  };
  static const std::array<Kind, 10> kKinds = {{{30, &Worker::look_up},
                                               {20, &Worker::update},
                                               {12, &Worker::add},
                                               {12, &Worker::move},
                                               {6, &Worker::remove},
                                               {3, &Worker::look_up_removed},
                                               {4, &Worker::ask_parent},
                                               {4, &Worker::publish},
                                               {4, &Worker::look_up_joint},
                                               {5, &Worker::contest}}};
  std::size_t draw = random_.index(100);
  for (const Kind& kind : kKinds) {
    if (draw < kind.share) return (this->*kind.run)();
    draw -= kind.share;
  }
}

template <class Value>
void Worker::record(const std::string& operation, const std::vector<std::string>& frames,
                    const std::string& details, const Result<Value>& result) {
  const std::string outcome = outcome_of(result);
  journal_.count(operation, outcome);
  if (!result && calm_ > kGrace && !denies(result.error().code)) {
    journal_.count("failed without a fault", operation + " " + outcome);
  }
  std::string line = seconds(journal_.now()) + " " + operation + " " + details + ": " + outcome;
  if (!result) line += " (" + result.error().message + ")";
  for (const std::string& frame : frames) {
    // A denial of a frame that may be gone gives no information.
    const bool expected = !result && denies(result.error().code) && !model_.frame(frame).certain();
    if (!expected) model_.note(frame, line);
  }
  // At this time no disk is full.
  if (!result && result.error().code == Errc::kState && calm_ > kGrace) {
    journal_.violation(prefix_ + " " + line);
  }
}

void Worker::contradiction(const std::string& what, const std::string& frame) {
  journal_.violation(prefix_ + " " + what, model_.frame(frame).history);
}

void Worker::denied(const std::string& what, const std::string& frame) {
  if (quiet()) return contradiction(what, frame);
  journal_.count("denied amid faults", what.substr(0, what.find(' ')));
}

std::vector<std::string> Worker::own(bool anchored) const { return model_.ids(prefix_, anchored); }

bool Worker::quiet() {
  if (calm_ <= kGrace) return false;
  const auto partitions = client_.partitions();
  return partitions && partitions->size() == partitions_ &&
         std::all_of(partitions->begin(), partitions->end(),
                     [](const PartitionInfo& partition) { return partition.reachable; });
}

std::string Worker::any_anchor() {
  const auto anchored = own(true);
  return anchored.empty() || random_.index(3) == 0 ? any_base() : any(anchored);
}

void Worker::add() {
  if (own(false).size() >= kFrames) return remove();
  const std::string id = prefix_ + std::to_string(added_++);
  const Place place{any_anchor(), random_.transform()};
  std::string partition;
  if (random_.index(2) == 0) partition = partition_name(random_.index(partitions_));
  const auto added = client_.add(id, place.parent, place.X_PC, partition);
  const std::string owner = partition.empty() ? model_.frame(place.parent).partition : partition;
  // No other client adds this frame: if it exists, an earlier attempt of the same call has added
  // it.
  const bool exists = !added && added.error().code == Errc::kAlreadyExists;
  const bool refused = !added && !exists && denies(added.error().code);
  model_.add(id, owner, place, added || exists);
  if (refused || (!added && never_asked(added.error()))) model_.gone(id);
  record("add", {id}, "in " + owner + " under " + place.parent + " at " + translation(place.X_PC),
         added);
  if (refused || exists) denied("add of " + id + ": " + added.error().message, id);
}

void Worker::update() {
  const auto ids = own(random_.index(10) != 0);
  if (ids.empty()) return;
  std::map<std::string, Transform> values;
  for (std::size_t count = 1 + random_.index(3); count > 0; --count) {
    values[any(ids)] = random_.transform();
  }
  std::vector<EdgeUpdate> edges;
  for (const auto& [id, X_PC] : values) edges.push_back({id, X_PC});
  const auto updated = client_.update(edges);
  const bool denial = !updated && denies(updated.error().code);
  const bool all_there = std::all_of(
      edges.begin(), edges.end(), [&](const EdgeUpdate& edge) { return model_.anchored(edge.id); });
  for (const EdgeUpdate& edge : edges) {
    const bool asked = updated || edges.size() > 1 || !(denial || never_asked(updated.error()));
    if (asked) model_.update(edge.id, edge.X_PC, updated.has_value());
    record("update", {edge.id}, "to " + translation(edge.X_PC), updated);
  }
  if (denial && all_there) denied("update: " + updated.error().message, edges.front().id);
}

void Worker::move() {
  const auto ids = own(true);
  if (ids.empty()) return;
  const std::string id = any(ids);
  const std::string parent = any_anchor();
  const bool cycle = model_.may_be_below(parent, id);
  // An owner that is cut off may not know that this is a cycle; then it makes the change, and
  // undoes it later.
  if (cycle && calm_ <= kGrace) return;
  std::optional<Transform> X_PC;
  if (random_.index(2) == 0) X_PC = random_.transform();
  const auto moved = client_.move(id, parent, X_PC ? PartialTransform(*X_PC) : PartialTransform());
  const bool refused = !moved && denies(moved.error().code);
  const bool asked = moved || !never_asked(moved.error());
  if (!refused && !cycle && asked) model_.move(id, parent, X_PC, moved.has_value());
  record("move", {id}, "under " + parent + (X_PC ? " at " + translation(*X_PC) : ""), moved);
  if (moved && cycle) contradiction("move of " + id + " makes a cycle", id);
  if (refused && !cycle) denied("move of " + id + ": " + moved.error().message, id);
}

void Worker::remove() {
  const auto ids = own(random_.index(4) != 0);
  if (ids.empty()) return;
  const std::string id = any(ids);
  const bool there = model_.anchored(id);
  std::vector<std::string> below;
  for (const auto& [other, frame] : model_.frames()) {
    if (frame.may_be_there() && model_.may_be_below(other, id)) below.push_back(other);
  }
  const auto removed = client_.remove(id);
  const bool denial = !removed && denies(removed.error().code);
  const std::string& owner = model_.frame(id).partition;
  const bool one_owner = std::all_of(below.begin(), below.end(), [&](const std::string& other) {
    return model_.frame(other).partition == owner;
  });
  const bool asked = removed || !one_owner || !never_asked(removed.error());
  if (!denial && asked) model_.remove(id, removed.has_value());
  record("remove", below, "of " + id, removed);
  if (removed) {
    removed_.push_back(id);
    if (removed_.size() > kRemovedKept) removed_.pop_front();
  }
  if (denial && there) denied("remove of " + id + ": " + removed.error().message, id);
}

void Worker::look_up() {
  // Frames whose place is not known are looked up until it is.
  const auto ids = own(random_.index(3) != 0);
  if (ids.empty()) return;
  const std::string b = any(ids);
  const std::string a = random_.index(3) == 0 ? "world" : any_anchor();
  const auto X_AB = client_.lookup(a, b);
  record("lookup", {b}, "in " + a + (X_AB ? " " + translation(*X_AB) : ""), X_AB);
  if (X_AB) {
    const std::string difference = model_.judge(a, b, X_AB->transform(), quiet());
    if (!difference.empty()) contradiction(difference, b);
  } else if (denies(X_AB.error().code)) {
    const std::string difference = model_.judge(a, b, std::nullopt, quiet());
    if (!difference.empty()) denied(difference + "\n  answer: " + X_AB.error().message, b);
    if (X_AB.error().code == Errc::kUnknownEnd && quiet()) model_.gone(b);
  }
}

void Worker::look_up_removed() {
  if (removed_.empty()) return;
  const std::string id = removed_[random_.index(removed_.size())];
  const auto X_WB = client_.lookup("world", id);
  record("lookup of a removed", {id}, X_WB ? translation(*X_WB) : "", X_WB);
  if (X_WB) contradiction("lookup of " + id + ", which was removed, is answered", id);
}

void Worker::ask_parent() {
  const auto ids = own(true);
  if (ids.empty()) return;
  const std::string id = any(ids);
  const auto parent = client_.parent(id);
  record("parent", {id}, parent ? *parent : "", parent);
  const std::string expected = model_.frame(id).possible.front()->parent;
  if (parent && *parent == expected) return;
  denied("parent of " + id + " is " + (parent ? *parent : parent.error().message) + ", not " +
             expected,
         id);
}

void Worker::publish() {
  std::vector<EdgeUpdate> edges;
  ++streamed_;
  for (const auto& [id, base] : joints_) edges.push_back({id, joint_value(streamed_, number_)});
  const auto published = client_.publish(edges);
  journal_.count("publish", outcome_of(published));
}

std::string Worker::judge_joint(const std::string& id, const Transform& X_PC) const {
  const Eigen::Vector3d t = X_PC.pose.translation();
  const double serial = std::round(t.x());
  const bool sent = serial >= 0 && serial <= streamed_;
  const Eigen::Vector3d expected(serial, static_cast<double>(number_), 0.5);
  if (sent && (t - expected).norm() < 1e-9) return "";
  return "joint " + id + " is at " + translation(X_PC) + ", which was not sent";
}

void Worker::look_up_joint() {
  const auto joint = std::next(joints_.begin(), static_cast<long>(random_.index(joints_.size())));
  const auto X_BJ = client_.lookup(joint->second, joint->first);
  journal_.count("lookup of a joint", outcome_of(X_BJ));
  if (!X_BJ) return;
  const std::string difference = judge_joint(joint->first, *X_BJ);
  if (!difference.empty()) journal_.violation(difference);
}

void Worker::contest() {
  const std::string id = contested_frame(random_.index(kContested));
  const std::string other = contested_frame(random_.index(kContested));
  const std::string parent = random_.index(2) == 0 ? any_base() : other;
  const std::size_t kind = random_.index(4);
  if (kind == 0) {
    journal_.count("contested remove", outcome_of(client_.remove(id)));
  } else if (kind == 1) {
    journal_.count("contested move", outcome_of(client_.move(id, parent)));
  } else {
    const auto partition = partition_name(random_.index(partitions_));
    const auto added = client_.add(id, parent, random_.transform(), partition);
    journal_.count("contested add", outcome_of(added));
  }
}

}  // namespace tfdude::faults
