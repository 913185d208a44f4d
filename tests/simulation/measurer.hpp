#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include <Eigen/Core>

#include "calls/observe_task.hpp"
#include "simulation/process.hpp"

namespace tfdude::simulation {

/// A client that measures parts of a chain of static edges in several partitions, sometimes two at
/// the same time, and looks up how certain they are. All measurements are right, so only the
/// covariances change.
///
/// Each part must be as certain as all measurements together make it, and not more. The client
/// begins another chain when it cannot know what the owners have: after an error, and after one of
/// them was started again.
class Measurer : public std::enable_shared_from_this<Measurer> {
 public:
  /// @param actor  the number by which its operations are counted
  /// @param owners  whose partitions it uses; none of them is renamed
  Measurer(std::shared_ptr<Process> process, std::size_t number, std::size_t actor,
           std::size_t owners);

  /// Goes on until stop().
  void start() { next(); }
  void stop() { stopped_ = true; }

  [[nodiscard]] Process& process() { return *process_; }
  [[nodiscard]] const std::map<std::string, std::size_t>& outcomes() const { return outcomes_; }
  /// How many frames it has tried to add.
  [[nodiscard]] std::size_t added() const { return kEdges * generation_; }

 private:
  static constexpr std::size_t kEdges = 3;

  /// Some edges of the chain: from the first to before the last.
  struct Section {
    std::size_t first;
    std::size_t last;
  };

  void next();
  void step();
  void restart();
  void add();
  void observe();
  void look_up();
  void begin(const std::string& what, const std::shared_ptr<Task>& task,
             std::function<void(const Result<void>&)> then);
  [[nodiscard]] bool owner_changed() const;
  void judge(const Section& section, const StampedTransform& X);
  [[nodiscard]] Section any_section();
  [[nodiscard]] std::string frame(std::size_t number) const;  // 0: what the chain hangs on

  std::shared_ptr<Process> process_;
  const std::size_t number_;
  const std::size_t actor_;
  const std::size_t owners_;
  testing::Random random_;  // of the current step
  std::string base_;
  std::array<std::string, kEdges> partitions_;
  std::array<std::uint64_t, kEdges> owners_then_{};  // processes that have added the edges
  std::size_t edges_ = 0;                            // that exist
  std::size_t generation_ = 0;                       // of the chain
  Eigen::Matrix3d information_;                      // of the edges, along x
  std::size_t measured_ = 0;                         // how often
  std::size_t open_ = 0;                             // measurements in progress
  bool doubtful_ = true;
  std::size_t steps_ = 0;
  std::map<std::string, std::size_t> outcomes_;
  bool stopped_ = false;
};

}  // namespace tfdude::simulation
