#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "simulation/actor.hpp"

namespace tfdude::simulation {

/// A client that writes samples of two edges of one path, by a clock that jumps forward, and looks
/// the newest transform of the path up. Along y and z they move with the time of the clock, so a
/// value shows for which instant it holds.
///
/// The answer must hold for one instant that all edges have, and be at most two samples of the
/// slowest edge older than the latest one. The client begins another path when it cannot know what
/// the owners have: after an error, and after one of them was started again.
class Pacer final : public Actor {
 public:
  /// @param actor  the number by which its operations are counted
  /// @param owners  whose partitions it uses; none of them is renamed
  Pacer(std::shared_ptr<Process> process, std::size_t number, std::size_t actor,
        std::size_t owners);

  [[nodiscard]] std::size_t added() const override { return kEdges * generation_; }

 private:
  static constexpr std::size_t kEdges = 2;

  struct Edge {
    std::string partition;
    std::uint64_t owner = 0;      // the process that has added it; 0: nobody has
    std::vector<Instant> stamps;  // of its samples
  };

  void step() override;
  [[nodiscard]] std::string title() const override { return frame(0); }
  void restart();
  void add(std::size_t edge);
  void write(std::size_t edge);
  void look_up();
  void begin(const std::string& what, const std::shared_ptr<Task>& task,
             std::function<void()> then);
  void judge(const StampedTransform& X);
  [[nodiscard]] bool is_known(Task& task);
  [[nodiscard]] Instant clock() const { return ahead_ + process_->world().timeline.now(); }
  [[nodiscard]] std::string frame(std::size_t edge) const;

  const std::size_t number_;
  std::string base_;
  std::array<Edge, kEdges> edges_;
  std::size_t generation_ = 0;  // of the path
  Instant ahead_{};             // of the clock
  bool doubtful_ = true;
};

}  // namespace tfdude::simulation
