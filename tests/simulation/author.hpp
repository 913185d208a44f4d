#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "faults/frames.hpp"
#include "faults/model.hpp"
#include "simulation/actor.hpp"
#include "simulation/joints.hpp"

namespace tfdude::simulation {

/// Number of frames that all clients change.
inline constexpr std::size_t kContested = 4;

/// A client that makes one call after the other and knows the possible results. It knows all about
/// its own frames, because no other client changes them.
class Author final : public Actor {
 public:
  /// @param actor  the number by which its operations are counted
  /// @param owners  whose partitions it uses; none of them is renamed
  Author(std::shared_ptr<Process> process, std::size_t number, std::size_t actor,
         std::size_t owners);

  /// A partition has lost its stored changes from an instant on.
  void lost_power(const std::string& partition, Instant first);
  /// Whether it ever has.
  [[nodiscard]] bool has_lost_power(const std::string& partition) const {
    return losses_.count(partition) > 0;
  }
  [[nodiscard]] std::size_t added() const override { return added_; }

  [[nodiscard]] faults::Model& model() { return model_; }
  [[nodiscard]] const Surroundings& world() const { return process_->world(); }

  /// Forgets a partition that is not reachable.
  void forget(const std::string& partition);
  /// Whether it has forgotten it for all since then.
  [[nodiscard]] bool has_forgotten(const std::string& partition, Instant since) const {
    const auto known = forgotten_.find(partition);
    return known != forgotten_.end() && known->second >= since;
  }
  /// Looks up b in a, and judges that.
  void look_up(const std::string& a, const std::string& b, bool quiet);

 private:
  void step() override;
  [[nodiscard]] std::string title() const override { return prefix_; }
  void add();
  void move();
  void update();
  void remove();
  void set_joint();
  void forget_one();
  void contest();
  void hand_over(const std::string& id);
  using RouteOf = std::function<Result<std::vector<Part>>(Process& caller)>;

  void change(const std::string& what, const std::string& owner, const RouteOf& route, Then then);
  void change_here(const std::shared_ptr<Process>& node, const std::string& what,
                   const Request& request, const Then& then);
  void begin(const std::string& what, RunningCall::Route route, Then then);
  void conclude(const std::string& what, const Result<void>& outcome, const Then& then);
  void stream_joint(double position);
  [[nodiscard]] OperationKind draw_kind();
  void remember();
  /// Whether a partition, or any, may have lost what it has acknowledged since then.
  /// Whether a process knows all changes that this author has made.
  [[nodiscard]] bool has_heard(Process& node) const;
  [[nodiscard]] bool may_be_lost(const std::string& partition, Instant since) const;
  [[nodiscard]] bool may_be_lost(Instant since) const;
  void judge(const std::string& a, const std::string& b, const Result<StampedTransform>& X_AB,
             bool quiet, Instant began);
  void doubt_unless_stored(const std::string& id, const Result<void>& outcome);
  void check_seen(const std::string& id, const std::string& parent);
  [[nodiscard]] std::vector<std::string> own(bool anchored) const;
  [[nodiscard]] std::string any(const std::vector<std::string>& ids);
  [[nodiscard]] std::string any_anchor();

  const std::string prefix_;
  const std::vector<MovedFrame> moved_;  // by its joint
  faults::Model model_;
  // What was known after each operation, if a power loss may undo some of them.
  std::deque<std::pair<Instant, faults::Model>> known_;
  std::map<std::string, Instant> losses_;  // the last power loss, by partition
  std::map<std::string, Instant> forgotten_;
  Instant began_{};       // of the current operation
  bool by_node_ = false;  // it was made by its owner's Node
  std::size_t added_ = 0;
};

}  // namespace tfdude::simulation
