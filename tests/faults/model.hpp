#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tfdude/math/transform.hpp"

namespace tfdude::faults {

/// The parent of a frame, and its edge.
struct Place {
  std::string parent;
  Transform X_PC;
};

/// What is known of the frames that only one client changes. After an acknowledged change one state
/// is possible. After a change without an answer two states are possible, with and without it,
/// until a later change of the same owner is acknowledged, or a lookup in quiet times decides: the
/// changes of one client to one owner arrive in order or not at all, but a lookup may overtake
/// them.
class Model {
 public:
  struct Frame {
    std::string partition;
    /// The possible states of the frame; an empty place: it does not exist.
    std::vector<std::optional<Place>> possible;
    /// A frame above it may have been removed: it may go as soon as its owner learns of that.
    bool doomed = false;
    /// The owners of that frame, and of those between: an owner that was unreachable learns of the
    /// removal from them.
    std::set<std::string> removed_by;
    /// A move had no answer: its owner may still make it, even after what it names was removed.
    bool may_move_late = false;
    /// Likewise any change: what a lookup shows may not be the last word.
    bool may_change_late = false;
    /// The state that its owner shows may not be stored: it is undone if the owner is killed.
    bool unsaved = false;
    std::vector<std::string> history;

    [[nodiscard]] bool may_be_there() const;
    [[nodiscard]] bool may_be_gone() const;
    [[nodiscard]] bool certain() const { return possible.size() == 1; }
  };

  /// A frame that always exists and that nobody changes.
  void fix(const std::string& id, const std::string& partition, const Place& place);

  // Requested changes, and whether it is known that they were made.
  void add(const std::string& id, const std::string& partition, const Place& place, bool done);
  void update(const std::string& id, const Transform& X_PC, bool done);
  void move(const std::string& id, const std::string& parent, const std::optional<Transform>& X_PC,
            bool done);
  void remove(const std::string& id, bool done);

  /// A partition may be again as an earlier model says: its stored changes since then may be lost.
  void may_be_as_in(const Model& earlier, const std::string& partition);

  /// A change may have been made, but could not be stored.
  void doubt(const std::string& id);

  /// A frame turned out not to exist, if that is possible.
  void gone(const std::string& id);

  /// Adds a line to a frame's history, which violations print.
  void note(const std::string& id, const std::string& line);

  /// The frames that exist or may exist.
  [[nodiscard]] const std::map<std::string, Frame>& frames() const { return frames_; }
  /// The frames that certainly do not exist any more.
  [[nodiscard]] const std::map<std::string, Frame>& removed() const { return removed_; }
  /// A frame of either kind.
  [[nodiscard]] const Frame& frame(const std::string& id) const;

  /// The frames whose names have this prefix and that may exist, or that are anchored.
  [[nodiscard]] std::vector<std::string> ids(const std::string& prefix, bool anchored) const;

  /// Whether a frame and all frames above it certainly exist, each with a known parent.
  [[nodiscard]] bool anchored(const std::string& id) const;
  /// Whether a frame is another one, or is or may be below it.
  [[nodiscard]] bool may_be_below(const std::string& id, const std::string& ancestor) const;

  /// Judges the answer to a lookup of b in a; empty: the answer is that one of the two does not
  /// exist or is not connected. Drops the possible states that the answer excludes.
  /// @param quiet  all participants must be up to date
  /// @return empty if one of the possible states has that answer; otherwise the expected answer
  [[nodiscard]] std::string judge(const std::string& a, const std::string& b,
                                  const std::optional<Transform>& X_AB, bool quiet);

 private:
  void allow_cycles();
  void allow_removals();
  [[nodiscard]] bool goes_with(const std::string& id, const std::string& ancestor) const;
  /// The frames on all paths that a frame may have up to another one, with both ends.
  [[nodiscard]] std::set<std::string> ways_up(const std::string& id,
                                              const std::string& ancestor) const;
  using State = std::map<std::string, const std::optional<Place>*>;

  [[nodiscard]] std::vector<std::string> closure(const std::string& a, const std::string& b) const;
  void each_state(const std::vector<std::string>& ids,
                  const std::function<void(const State&)>& see) const;

  std::map<std::string, Frame> frames_;
  std::map<std::string, Frame> removed_;
};

}  // namespace tfdude::faults
