#include "simulation/measurer.hpp"

#include <cmath>
#include <utility>

#include <Eigen/LU>

#include "faults/frames.hpp"

namespace tfdude::simulation {
namespace {

using faults::base_of;
using faults::partition_name;

// Of the edges, and of a measurement, along each axis [m, rad].
constexpr double kStddev = 0.1;

Transform exact_to(double stddev) {
  return {Pose(),
          Covariance::from_stddev({stddev, stddev, stddev, stddev, stddev, stddev}).value()};
}

double variance_of(const Transform& X) { return X.covariance.of_specified().upper()[0]; }

}  // namespace

Measurer::Measurer(std::shared_ptr<Process> process, std::size_t number, std::size_t actor,
                   std::size_t owners)
    : Actor(std::move(process), "measurer", actor, owners, milliseconds(150)), number_(number) {}

std::string Measurer::frame(std::size_t number) const {
  if (number == 0) return base_;
  return "m" + std::to_string(number_) + "_" + std::to_string(generation_) + "_" +
         std::to_string(number);
}

void Measurer::go_on() {
  if (open_ == 0) next();
}

void Measurer::step() {
  if (doubtful_ || owner_changed()) restart();
  if (edges_ < kEdges) return add();
  if (random_.index(3) == 0) return look_up();
  const bool two = random_.index(2) == 0;
  ++open_;
  observe();
  if (two) observe();
  --open_;
  go_on();
}

void Measurer::begin(const std::string& what, const std::shared_ptr<Task>& task, Then then) {
  ++open_;
  Actor::begin(what, task, [this, then = std::move(then)](const Result<void>& outcome) {
    if (!outcome) doubtful_ = true;
    then(outcome);
    --open_;
    go_on();
  });
}

// Uses new names of frames, because the state of the former ones is not known.
void Measurer::restart() {
  doubtful_ = false;
  ++generation_;
  exact_ = true;
  edges_ = measured_ = 0;
  base_ = base_of(random_.index(owners_));
  for (std::string& partition : partitions_) partition = partition_name(random_.index(owners_));
  information_ = Eigen::Matrix3d::Identity() / (kStddev * kStddev);
}

// Another process may have read an older state than the one that has replied.
bool Measurer::owner_changed() const {
  for (std::size_t k = 0; k < edges_; ++k) {
    const auto owner = process_->world().serving(partitions_.at(k));
    if (owner == nullptr || owner->id() != owners_then_.at(k)) return true;
  }
  return false;
}

void Measurer::add() {
  const auto task = RunningCall::change([this] {
    return route_add(process_->forest(), process_->directory(), frame(edges_ + 1),
                     AddRequest{frame(edges_), exact_to(kStddev)}, partitions_.at(edges_))
        .map([](Part part) { return std::vector<Part>{std::move(part)}; });
  });
  begin("add", task, [this, task](const Result<void>& added) {
    if (added) owners_then_.at(edges_++) = process_->replied_by(task->parts().front());
  });
}

Measurer::Section Measurer::any_section() {
  const std::size_t first = random_.index(kEdges);
  return {first, first + 1 + random_.index(kEdges - first)};
}

void Measurer::observe() {
  const Section section = any_section();
  Eigen::Vector3d edges = Eigen::Vector3d::Zero();
  for (std::size_t k = section.first; k < section.last; ++k) edges[static_cast<long>(k)] = 1;
  information_ += edges * edges.transpose() / (kStddev * kStddev);
  ObserveOptions options;
  options.gate = 1;
  const std::string source =
      std::string(kObservedPrefix) + frame(1) + "." + std::to_string(++measured_);
  const auto task = std::make_shared<ObserveTask>(
      process_->forest(),
      Measurement{frame(section.first), frame(section.last), exact_to(kStddev), {}, options},
      std::string(), source, EarlierObservations(), false,
      TimeLimit(RunningCall::kTimeout, process_->world().timeline.steady()));
  begin("observe " + std::to_string(section.first) + "-" + std::to_string(section.last), task,
        [this, task](const Result<void>&) {
          if (!task->beside_others()) return;
          exact_ = false;
          process_->world().count("an observation was beside one that had not come everywhere");
        });
}

void Measurer::look_up() {
  const Section section = any_section();
  const auto task = process_->lookup(frame(section.first), frame(section.last));
  begin("lookup", task, [this, section, task](const Result<void>& outcome) {
    if (!outcome || doubtful_ || owner_changed()) return;
    for (const Part& part : task->parts()) {
      for (std::size_t k = 0; k < kEdges; ++k) {
        const bool other = process_->replied_by(part) != owners_then_.at(k);
        if (partitions_.at(k) == part.partition && other) doubtful_ = true;
      }
    }
    if (!doubtful_) judge(section, task->X_AB());
  });
}

void Measurer::judge(const Section& section, const StampedTransform& X) {
  Surroundings& world = process_->world();
  const Eigen::Matrix3d sigma = information_.inverse();
  double least = 0;
  for (std::size_t i = section.first; i < section.last; ++i) {
    for (std::size_t k = section.first; k < section.last; ++k) {
      least += sigma(static_cast<long>(i), static_cast<long>(k));
    }
  }
  const double variance = variance_of(X);
  if (measured_ > 0) world.count("a measured path was looked up");
  if (variance < least * (1 - 1e-6)) {
    world.violation("an observation is applied twice",
                    frame(section.last) + " in " + frame(section.first) + " has a variance of " +
                        std::to_string(variance) + ", after " + std::to_string(measured_) +
                        " measurements, that allow " + std::to_string(least));
  } else if (exact_ && variance > least * (1 + 1e-6)) {
    world.violation("an observation is lost", frame(section.last) + " in " + frame(section.first) +
                                                  " has a variance of " + std::to_string(variance) +
                                                  " instead of " + std::to_string(least));
  }
}

}  // namespace tfdude::simulation
