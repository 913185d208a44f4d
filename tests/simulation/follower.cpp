#include "simulation/follower.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "faults/frames.hpp"

namespace tfdude::simulation {
namespace {

using faults::base_edge;
using faults::base_of;
using faults::denies;
using faults::partition_name;

Transform at(double y, double z) {
  return {Pose::trusted(Eigen::Quaterniond::Identity(), {0, y, z}), {}};
}

// The number of a value is the y of its first edge; along z the two edges cancel each other.
Transform first_edge(std::size_t value) {
  return at(static_cast<double>(value), static_cast<double>(value));
}
Transform second_edge(std::size_t value) { return at(0, -static_cast<double>(value)); }

}  // namespace

Follower::Follower(std::shared_ptr<Process> process, std::size_t number, std::size_t actor,
                   std::size_t owners)
    : Actor(std::move(process), "follower", actor, owners, milliseconds(60)), number_(number) {}

std::string Follower::id(const char* which) const {
  return "w" + std::to_string(number_) + "_" + std::to_string(generation_) + "_" + which;
}

void Follower::step() {
  if (watch_ == nullptr) return arm_added_ ? add_tip() : restart();
  if (random_.index(3) == 0) return move();
  write();
}

void Follower::begin(const std::string& what, RunningCall::Route route, Then then) {
  process_->world().trace(tip() + ": begins to " + what);
  began_ = process_->world().timeline.now();
  Actor::begin(what, RunningCall::change(std::move(route)),
               [this, then = std::move(then)](const Result<void>& outcome) {
                 // What was sent without an answer arrives before what is sent next, or is lost.
                 if (!outcome) rest_ = process_->world().network.longest_delay();
                 then(outcome);
                 next();
               });
}

// Uses new names of frames, because the state of the former ones is not known.
void Follower::restart() {
  ++generation_;
  watch_.reset();
  const std::size_t base = random_.index(owners_);
  partition_ = partition_name(random_.index(owners_));
  bases_ = ever_ = {base};
  written_ = {{bases_}};
  newest_read_ = 0;
  shown_base_.reset();
  incarnation_ = 0;
  may_go_back_ = false;
  applied_ = stored_ = floor_ = 0;
  begin(
      "add the arm",
      [this, base, id = arm()] {
        return route_add(process_->forest(), process_->directory(), id,
                         AddRequest{base_of(base), first_edge(0)}, partition_)
            .map([](Part part) { return std::vector<Part>{std::move(part)}; });
      },
      [this](const Result<void>& added) { arm_added_ = added.has_value(); });
}

void Follower::add_tip() {
  begin(
      "add the tip",
      [this, arm = arm(), tip = tip()] {
        return route_add(process_->forest(), process_->directory(), tip,
                         AddRequest{arm, second_edge(0)}, partition_)
            .map([](Part part) { return std::vector<Part>{std::move(part)}; });
      },
      [this](const Result<void>& added) {
        arm_added_ = false;
        if (!added) return;
        watch_ = std::make_shared<WatchedPath>("world", tip(), WatchOptions());
        process_->watch(watch_, [this] { look(); });
      });
}

std::vector<EdgeUpdate> Follower::both(std::size_t value) const {
  return {{arm(), first_edge(value)}, {tip(), second_edge(value)}};
}

void Follower::write() {
  const std::size_t value = written_.size();
  written_.push_back({bases_});
  switch (random_.index(4)) {
    case 0:
      return stream(value);
    case 1:
      return write_here(value);
    default:
      return request(value);
  }
}

void Follower::request(std::size_t value) {
  begin(
      "write " + std::to_string(value),
      [this, value] {
        return route_update(process_->forest(), process_->directory(), both(value), std::nullopt);
      },
      [this, value](const Result<void>& updated) {
        forget_order_after_restart();
        if (updated && !may_be_lost()) {
          written(value);
          stored_ = applied_;
        } else if (!updated && denies(updated.error().code)) {
          watch_.reset();
        }
      });
}

void Follower::written(std::size_t value) {
  applied_ = value;
  for (std::size_t i = 0; i < value; ++i) written_[i].replaced = true;
}

void Follower::stream(std::size_t value) {
  process_->world().trace(tip() + ": streams value " + std::to_string(value));
  const auto parts = route_publish(process_->forest(), process_->directory(), both(value));
  for (const Part& part : parts ? *parts : std::vector<Part>()) {
    process_->stream(part.partition, Update{std::get<UpdateRequest>(part.request.body).edges});
  }
  rest_ = process_->world().network.longest_delay();
  next();
}

// A Node in the process of the owner asks nobody.
void Follower::write_here(std::size_t value) {
  const auto node = process_->world().serving(partition_);
  if (node == nullptr) return request(value);
  if (node->forest().update(both(value))) {
    process_->world().trace(tip() + ": a node writes value " + std::to_string(value));
    process_->world().count("a node wrote a watched value");
    written(value);
  }
  next();
}

void Follower::moving_to(std::size_t base) {
  bases_.insert(base);
  ever_.insert(base);
  for (Written& one : written_) {
    if (!one.replaced) one.bases.insert(base);
  }
}

void Follower::move() {
  const std::size_t base = random_.index(owners_);
  moving_to(base);
  forget_order_after_restart();
  begin(
      "move below " + base_of(base),
      [this, base, id = arm()] {
        return route_move(process_->forest(), process_->directory(), id,
                          MoveRequest{base_of(base), {}})
            .map([](Part part) { return std::vector<Part>{std::move(part)}; });
      },
      [this, base, applied = applied_, incarnation = incarnation_](const Result<void>& moved) {
        if (!moved || may_be_lost()) return;
        bases_ = {base};
        forget_order_after_restart();
        // With the move, the same process has stored all values that it had.
        if (incarnation_ == incarnation) stored_ = std::max(stored_, applied);
      });
}

Result<StampedTransform> Follower::read() const {
  if (watch_ == nullptr) return fail(Errc::kUnknownEnd, "nothing is watched");
  return watch_->lookup({});
}

void Follower::look() {
  if (watch_ == nullptr) return;
  if (const auto X = watch_->lookup({})) judge(*X);
}

// Values that were not stored yet are lost with their owner's process: the next process may have
// older ones, but none older than it has stored.
void Follower::forget_order_after_restart() {
  const auto serving = process_->directory().serving(partition_);
  if (!serving || serving->incarnation == incarnation_) return;
  if (std::exchange(incarnation_, serving->incarnation) == 0) return;
  process_->world().count("the owner of a watched path was started again");
  may_be_older();
}

void Follower::lost_power(const std::string& partition) {
  if (partition != partition_) return;
  lost_ = process_->world().timeline.now();
  bases_ = ever_;
  stored_ = 0;
  may_be_older();
}

void Follower::may_be_older() {
  may_go_back_ = true;
  applied_ = floor_ = stored_;
  for (std::size_t i = stored_; i < written_.size(); ++i) {
    written_[i].replaced = false;
    written_[i].bases.insert(bases_.begin(), bases_.end());
  }
}

void Follower::judge(const StampedTransform& X) {
  forget_order_after_restart();
  Surroundings& world = process_->world();
  const Eigen::Vector3d at = X.pose.translation();
  const auto base = static_cast<std::size_t>(std::lround(at.x()) - 1);
  const Eigen::Vector3d of_base = base_edge(base).pose.translation();
  const std::string what = tip() + " was seen at (" + std::to_string(at.x()) + ", " +
                           std::to_string(at.y()) + ", " + std::to_string(at.z()) + ")";
  const double value = at.y() - of_base.y();
  if (std::abs(at.x() - of_base.x()) > 1e-9 || std::abs(at.z() - of_base.z()) > 1e-9) {
    return world.violation("half a commit", what + ", half of what was written");
  }
  const auto number = static_cast<std::size_t>(std::lround(value));
  if (value < -1e-9 || number >= written_.size()) {
    return world.violation("a value that nobody wrote", what + ", which nobody has written");
  }
  // Values of the owner's former process may be shown until all pages of the next one have arrived.
  if (number < newest_read_ && (number < floor_ || !std::exchange(may_go_back_, false))) {
    return world.violation("regress", what + ": value " + std::to_string(number) + " after " +
                                          std::to_string(newest_read_));
  }
  if (written_[number].bases.count(base) == 0) {
    return world.violation("a value elsewhere", what + ": value " + std::to_string(number) +
                                                    " never was below " + base_of(base));
  }
  if (number > newest_read_) {
    world.count("a watched path showed something newer");
    world.trace(tip() + ": sees value " + std::to_string(number) + " below " + base_of(base));
  }
  newest_read_ = number;
  if (shown_base_ && *shown_base_ != base) world.count("a watched path took another route");
  shown_base_ = base;
}

}  // namespace tfdude::simulation
