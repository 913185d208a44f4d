#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "partition/messages.hpp"
#include "partition/state_store.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// check_joint() of all frames that have one; the error names the frame, too.
[[nodiscard]] Result<void> check_joints(const std::vector<FrameSpec>& frames);

/// A frame's value before anything was said of it: of one with a joint, at the joint's position.
[[nodiscard]] Transform value_of(const FrameSpec& frame);

/// Where an earlier process has left a joint: by the one that it follows, if that is among them.
[[nodiscard]] std::optional<StoredJoint> left_of(const JointSpec& joint,
                                                 const std::vector<StoredJoint>& left);

/// The joints of a partition: turns their positions into values of the edges that they move. A joint moves its edge until
/// the frame is removed or moved by request.
///
/// @par Thread safety  The caller serializes all functions but moves(), which may run beside all but put().
class Joints {
 public:
  explicit Joints(Forest& forest) : forest_(forest) {}

  /// Has a joint move a held frame. @param left  where an earlier process left it; absent: where its description says
  void put(const std::string& frame, const JointSpec& joint,
           const std::optional<StoredJoint>& left);

  /// The frame is moved by hand from now on.
  void let_go(const std::string& frame);

  /// Whether a position of the joint concerns this partition. O(log joints); takes no lock.
  [[nodiscard]] bool moves(std::string_view name) const {
    return by_name_.find(name) != by_name_.end();
  }

  /// Whether the frame's error is that of a joint that others follow, or that follows another.
  [[nodiscard]] bool is_coupled(std::string_view frame) const;

  /// Moves what these joints and those that follow them move, as one commit. Joints that others have are passed over,
  /// as are those that follow: where they are says the one that they follow.
  /// @return how many edges were moved; kInvalidInput naming the joint: not a number, too large, negative variance, named
  ///   twice, outside the limits of a strict joint; as Forest::update(). Where it fails nothing is moved.
  [[nodiscard]] Result<std::size_t> apply(const JointUpdate& update);

  /// Sorted by name, those that come after this one; kMaxItems at most.
  [[nodiscard]] std::vector<JointInfo> infos(std::string_view after = {}) const;

  /// The frames that a joint of this name moves, with those that follow it.
  [[nodiscard]] std::vector<std::string> frames_of(std::string_view name) const;

  /// Those that have got positions since the last call.
  [[nodiscard]] std::vector<StoredJoint> take_changed();
  /// They could not be saved: they will be taken again.
  void still_changed(const std::vector<StoredJoint>& joints);

 private:
  struct Mover {
    std::string frame;
    Handle handle;
    JointSpec spec;
    double position = 0;
    double variance = 0;
    std::optional<Time> stamp{};  // of the newest sample
    bool measured = false;
    bool changed = false;
    bool let_go = false;
    std::uint64_t outside = 0;
    std::uint64_t refused = 0;
    std::uint64_t planned = 0;  // which update has moved it last
    // What a coupled joint's error is said to be, for which variance.
    Correlation said{};
    double said_variance = -1;
  };
  // Where a sample takes a mover.
  struct Step {
    std::size_t mover = 0;
    double position = 0;
    double variance = 0;
    bool outside = false;
  };

  [[nodiscard]] Result<void> plan(const JointValue& value);
  [[nodiscard]] bool is_newer(const Mover& mover, std::optional<Time> stamp) const;
  [[nodiscard]] bool starts_again(const Mover& mover, Time stamp) const;
  void take(const Step& step, std::optional<Time> stamp);
  void forget_removed();

  Forest& forest_;
  std::vector<Mover> movers_;
  // Which movers a joint has: its own and those that follow it. Of one that follows, none.
  std::map<std::string, std::vector<std::size_t>, std::less<>> by_name_;
  std::uint64_t plans_ = 0;                // updates so far
  std::vector<Step> steps_;                // of the update being made, as
  std::vector<CorrelatedUpdate> updates_;  // these; both kept for their memory
};

}  // namespace tfdude
