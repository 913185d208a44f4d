#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "partition/messages.hpp"
#include "partition/state_store.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// check_joint() for all frames with a joint; the error also names the frame.
[[nodiscard]] Result<void> check_joints(const std::vector<FrameSpec>& frames);

/// A frame's initial value: with a joint, the value at the joint's position.
[[nodiscard]] Transform value_of(const FrameSpec& frame);

/// The names of a joint and of the one that it mimics.
[[nodiscard]] PageJoint names_of(const JointSpec& joint);
/// Those of all frames with a joint, by id.
[[nodiscard]] std::map<std::string, PageJoint> joints_of(const std::vector<FrameSpec>& frames);

/// The position that an earlier process left for a joint: that of the joint it follows, if stored.
[[nodiscard]] std::optional<StoredJoint> left_of(const JointSpec& joint,
                                                 const std::vector<StoredJoint>& left);

/// The joints of a partition: converts positions to values of the edges that they move. A joint
/// moves its edge until the frame is removed or moved by request.
///
/// @par Thread safety  The caller serializes all functions except moves(), which may run
///   concurrently with all but put().
class Joints {
 public:
  explicit Joints(Forest& forest) : forest_(forest) {}

  /// Assigns a joint to a held frame.
  /// @param left  position from an earlier process; absent: that of the description
  void put(const std::string& frame, const JointSpec& joint,
           const std::optional<StoredJoint>& left);

  /// From now on the joint does not move the frame.
  void detach_joint(const std::string& frame);

  /// Whether a position of the joint concerns this partition. O(log joints); takes no lock.
  [[nodiscard]] bool moves(std::string_view name) const {
    return by_name_.find(name) != by_name_.end();
  }
  /// Whether there are joints. Constant once the partition serves; takes no lock.
  [[nodiscard]] bool moves_any() const { return !by_name_.empty(); }

  /// Whether the frame's joint follows another one or is followed, and so shares its error.
  [[nodiscard]] bool is_coupled(std::string_view frame) const;

  /// Moves the edges of these joints, and of those that follow them, as one commit. Ignores joints
  /// of other partitions and followers, whose position is that of the joint they follow.
  /// @return the number of moved edges; kInvalidInput naming the joint: not a number, too large,
  ///   negative variance, named twice, outside the limits of a strict joint; errors of
  ///   Forest::update(). On an error nothing is moved.
  [[nodiscard]] Result<std::size_t> apply(const JointUpdate& update);

  /// From now on infos() are these, which move no frame.
  void show(std::vector<JointInfo> joints);
  /// Sorted by name, starting after this one; at most kMaxItems.
  [[nodiscard]] std::vector<JointInfo> infos(std::string_view after = {}) const;

  /// Of these stored positions, those of joints that had none to start with here, or that move
  /// nothing, are erased: samples for others do not change them any more.
  void erase_unused(const std::vector<StoredJoint>& stored);

  /// The joints whose stored positions must be erased, since the last call: they move nothing.
  [[nodiscard]] std::vector<std::string> take_erased();
  /// They could not be erased: the next take_erased() returns them again.
  void still_erased(const std::vector<std::string>& names) {
    erased_.insert(names.begin(), names.end());
  }

  /// The joints with new positions since the last call.
  [[nodiscard]] std::vector<StoredJoint> take_changed();
  /// They could not be saved: the next take_changed() returns them again.
  void still_changed(const std::vector<StoredJoint>& joints);

 private:
  struct Mover {
    std::string frame;
    Handle handle;
    JointSpec spec;
    double position = 0;
    std::optional<double> variance{};
    std::optional<Time> stamp{};  // of the newest sample
    bool measured = false;
    bool changed = false;
    bool detached = false;
    std::uint64_t outside = 0;
    std::uint64_t refused = 0;
    std::uint64_t planned = 0;  // number of the last update that moved it
    // The error set for a coupled joint, and its variance.
    Correlation said{};
    std::optional<double> said_variance{};
  };
  // The effect of a sample on a mover.
  struct Step {
    std::size_t mover = 0;
    double position = 0;
    std::optional<double> variance{};
    bool outside = false;
  };

  [[nodiscard]] Result<void> plan(const JointValue& value);
  [[nodiscard]] static bool is_newer(const Mover& mover, std::optional<Time> stamp);
  [[nodiscard]] bool starts_again(const Mover& mover, Time stamp) const;
  void take(const Step& step, std::optional<Time> stamp);
  void forget_removed();
  void detach(Mover& mover);

  Forest& forest_;
  std::vector<Mover> movers_;
  std::vector<JointInfo> shown_;  // instead, sorted by name
  // The movers of a joint: its own and those that follow it. Empty for a follower.
  std::map<std::string, std::vector<std::size_t>, std::less<>> by_name_;
  std::set<std::string> erased_;           // with stored positions that must be erased
  std::uint64_t plans_ = 0;                // number of updates so far
  std::vector<Step> steps_;                // of the current update; kept to reuse its memory
  std::vector<CorrelatedUpdate> updates_;  // as steps_
};

}  // namespace tfdude
