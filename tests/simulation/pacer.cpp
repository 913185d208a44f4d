#include "simulation/pacer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "faults/frames.hpp"
#include "partition/latest.hpp"

namespace tfdude::simulation {
namespace {

using faults::base_of;
using faults::partition_name;

double seconds_of(Instant time) { return std::chrono::duration<double>(time).count(); }

}  // namespace

Pacer::Pacer(std::shared_ptr<Process> process, std::size_t number, std::size_t actor,
             std::size_t owners)
    : Actor(std::move(process), "pacer", actor, owners, milliseconds(100)), number_(number) {}

std::string Pacer::frame(std::size_t edge) const {
  return "p" + std::to_string(number_) + "_" + std::to_string(generation_) + "_" +
         std::to_string(edge);
}

void Pacer::step() {
  if (doubtful_) restart();
  for (std::size_t k = 0; k < kEdges; ++k) {
    if (edges_.at(k).owner == 0) return add(k);
  }
  // Less than a history spans.
  if (random_.index(40) == 0) ahead_ += milliseconds(2000 + random_.index(3000));
  const std::size_t what = random_.index(8);
  if (what == 0) return look_up();
  write(what < 6 ? 0 : 1);
}

void Pacer::begin(const std::string& what, const std::shared_ptr<Task>& task,
                  std::function<void()> then) {
  Actor::begin(what, task, [this, then = std::move(then)](const Result<void>& outcome) {
    if (outcome) {
      then();
    } else {
      doubtful_ = true;
    }
    next();
  });
}

// Uses new names of frames, because the state of the former ones is not known.
void Pacer::restart() {
  doubtful_ = false;
  ++generation_;
  base_ = base_of(random_.index(owners_));
  for (Edge& edge : edges_) edge = {partition_name(random_.index(owners_)), 0, {}};
}

void Pacer::add(std::size_t edge) {
  const auto task = RunningCall::change([this, edge] {
    return route_add(process_->forest(), process_->directory(), frame(edge),
                     AddRequest{edge == 0 ? base_ : frame(edge - 1), Transform()},
                     edges_.at(edge).partition)
        .map([](Part part) { return std::vector<Part>{std::move(part)}; });
  });
  begin("add", task, [this, edge, task] {
    edges_.at(edge).owner = process_->replied_by(task->parts().front());
  });
}

// Whether the processes that have answered are those that have added the edges.
bool Pacer::is_known(Task& task) {
  for (const Part& part : task.parts()) {
    for (const Edge& edge : edges_) {
      const bool other = process_->replied_by(part) != edge.owner;
      if (edge.partition == part.partition && other) doubtful_ = true;
    }
  }
  return !doubtful_;
}

void Pacer::write(std::size_t edge) {
  const Instant stamp = clock();
  const double time = seconds_of(stamp);
  const Transform X{Pose::trusted(Eigen::Quaterniond::Identity(),
                                  {0, edge == 0 ? time : 0, edge == 0 ? 0 : time}),
                    {}};
  const auto task = RunningCall::change([this, edge, stamp, X] {
    return route_update(process_->forest(), process_->directory(),
                        std::vector<EdgeUpdate>{{frame(edge), X}}, Time(stamp));
  });
  begin("write " + std::to_string(edge), task, [this, edge, stamp, task] {
    if (is_known(*task)) edges_.at(edge).stamps.push_back(stamp);
  });
}

void Pacer::look_up() {
  const auto task = process_->lookup(base_, frame(kEdges - 1));
  begin("lookup", task, [this, task] {
    if (is_known(*task)) judge(task->X_AB());
  });
}

void Pacer::judge(const StampedTransform& X) {
  Surroundings& world = process_->world();
  const bool all = std::all_of(edges_.begin(), edges_.end(),
                               [](const Edge& edge) { return edge.stamps.size() > 1; });
  if (!X.stamp || !all) return;
  Instant latest = Instant::max();
  Instant period{0};
  for (const Edge& edge : edges_) {
    latest = std::min(latest, edge.stamps.back());
    period = std::max(period, edge.stamps.back() - *(edge.stamps.end() - 2));
  }
  const Instant at(X.stamp->time_since_epoch());
  const Eigen::Vector3d seen = X.pose.translation();
  const std::string what = frame(kEdges - 1) + " at " + std::to_string(seconds_of(at)) + " s";
  world.count("the newest of a path of two owners was looked up");
  if (at < latest) world.count("an earlier instant was predicted");
  if (std::abs(seen.y() - seconds_of(at)) > 1e-6 || std::abs(seen.z() - seconds_of(at)) > 1e-6) {
    world.violation("half of another instant",
                    what + " is at " + std::to_string(seen.y()) + ", " + std::to_string(seen.z()));
  } else if (at > latest || at < latest - std::min<Instant>(2 * period, kOldestGuess)) {
    world.violation("not the latest common time",
                    what + ", which is " + std::to_string(seconds_of(latest)) + " s");
  }
}

}  // namespace tfdude::simulation
