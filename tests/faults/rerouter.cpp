#include "faults/rerouter.hpp"

#include <algorithm>
#include <chrono>
#include <optional>

#include "faults/worker.hpp"
#include "support/process.hpp"

namespace tfdude::faults {
namespace {

constexpr const char* kFrame = "switched";
constexpr std::chrono::milliseconds kMoveEvery{20};
constexpr std::size_t kReads = 200;  // between two looks at the clock

Transform shifted(double z) {
  return {Pose::trusted(Eigen::Quaterniond::Identity(), {0, 0, z}), {}};
}

}  // namespace

Rerouter::Rerouter(Client mover, Client watcher, std::size_t partitions, Journal& journal)
    : mover_(std::move(mover)),
      watcher_(std::move(watcher)),
      journal_(journal),
      owner_(partition_name(partitions - 1)),
      parents_{base_of(0), base_of(partitions > 1 ? 1 : 0)},
      X_PS_{shifted(10), shifted(20)} {
  for (std::size_t i = 0; i < parents_.size(); ++i) {
    const std::size_t base = partitions > 1 ? i : 0;
    legal_[i] = (base_edge(base).pose * X_PS_[i].pose).translation();
  }
  Result<void> added;
  if (!testing::eventually([&] {
        added = mover_.add(kFrame, parents_[0], X_PS_[0], owner_);
        return added || added.error().code == Errc::kAlreadyExists;
      })) {
    journal_.violation(std::string("no frame ") + kFrame + ": " + added.error().message);
  }
  moving_ = std::thread([this] { move(); });
  reading_ = std::thread([this] { read(); });
}

void Rerouter::stop() {
  stopping_ = true;
  for (std::thread* thread : {&moving_, &reading_}) {
    if (thread->joinable()) thread->join();
  }
}

void Rerouter::move() {
  for (std::size_t i = 1; !stopping_; ++i) {
    const auto moved = mover_.move(kFrame, parents_[i % 2], X_PS_[i % 2]);
    journal_.count("move beside a watching reader", outcome_of(moved));
    std::this_thread::sleep_for(kMoveEvery);
  }
}

void Rerouter::judge(const Result<StampedTransform>& X_WS, double calm) {
  journal_.count("read of a watched path", outcome_of(X_WS));
  if (!X_WS) {
    if (calm > kGrace) {
      journal_.violation("a watched path is not read in the calm: " + X_WS.error().message);
    }
    return;
  }
  const Eigen::Vector3d& t = X_WS->pose.translation();
  const bool is_legal = std::any_of(legal_.begin(), legal_.end(), [&](const Eigen::Vector3d& way) {
    return (t - way).norm() < 1e-9;
  });
  if (is_legal) return;
  journal_.violation("a watched path is read at (" + std::to_string(t.x()) + " " +
                     std::to_string(t.y()) + " " + std::to_string(t.z()) +
                     "), which is on neither of its ways");
}

void Rerouter::read() {
  std::optional<PathWatch> path;
  while (!stopping_) {
    if (!path) {
      if (auto watched = watcher_.watch("world", kFrame)) path = *std::move(watched);
      continue;
    }
    const double calm = journal_.calm();
    for (std::size_t i = 0; i < kReads; ++i) judge(path->latest(), calm);
    // Leaves the machine time for the processes that answer.
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

}  // namespace tfdude::faults
