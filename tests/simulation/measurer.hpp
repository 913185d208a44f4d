#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>

#include <Eigen/Core>

#include "calls/observe_task.hpp"
#include "simulation/actor.hpp"

namespace tfdude::simulation {

/// A client that measures parts of a chain of static edges in several partitions, sometimes two at
/// the same time, and looks up how certain they are. All measurements are right, so only the
/// covariances change.
///
/// Each part must be as certain as all measurements together make it, and not more. The client
/// begins another chain when it cannot know what the owners have: after an error, and after one of
/// them was started again.
class Measurer final : public Actor {
 public:
  /// @param actor  the number by which its operations are counted
  /// @param owners  whose partitions it uses; none of them is renamed
  Measurer(std::shared_ptr<Process> process, std::size_t number, std::size_t actor,
           std::size_t owners);

  [[nodiscard]] std::size_t added() const override { return kEdges * generation_; }

 private:
  static constexpr std::size_t kEdges = 3;

  /// Some edges of the chain: from the first to before the last.
  struct Section {
    std::size_t first;
    std::size_t last;
  };

  void step() override;
  [[nodiscard]] std::string title() const override { return frame(edges_); }
  void go_on();
  void restart();
  void add();
  void observe();
  void look_up();
  void begin(const std::string& what, const std::shared_ptr<Task>& task, Then then);
  [[nodiscard]] bool owner_changed() const;
  void judge(const Section& section, const StampedTransform& X);
  [[nodiscard]] Section any_section();
  [[nodiscard]] std::string frame(std::size_t number) const;  // 0: what the chain hangs on

  const std::size_t number_;
  std::string base_;
  std::array<std::string, kEdges> partitions_;
  std::array<std::uint64_t, kEdges> owners_then_{};  // processes that have added the edges
  std::size_t edges_ = 0;                            // that exist
  std::size_t generation_ = 0;                       // of the chain
  Eigen::Matrix3d information_;                      // of the edges, along x
  std::size_t measured_ = 0;                         // how often
  std::size_t open_ = 0;                             // measurements in progress
  bool doubtful_ = true;
  bool exact_ = true;  // no observation had to keep what another one was about to correct
};

}  // namespace tfdude::simulation
