#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tfdude/math/transform.hpp"

namespace tfdude::faults {

/// Where a frame hangs, and its edge.
struct Place {
  std::string parent;
  Transform X_PC;
};

/// What is known of the frames that one client alone changes. An acknowledged change leaves one
/// possibility; one without an answer leaves both, that it was made and that it was not, until an
/// answer tells which. A later answer of the same owner does: what one client sends to one owner
/// arrives in order or not at all.
class Model {
 public:
  struct Frame {
    std::string partition;
    /// What the frame may be now; an empty place: not there.
    std::vector<std::optional<Place>> possible;
    /// What it hangs below was removed, perhaps: it may go as soon as its owner learns of that.
    bool doomed = false;
    /// The owners of that, and of what was between: one that was away learns of the removal from
    /// them.
    std::set<std::string> removed_by;
    /// A move had no answer: its owner may still make it, even after what it names was removed.
    bool may_move_late = false;
    /// What its owner shows may not be stored: it is undone where the owner is killed.
    bool unsaved = false;
    std::deque<std::string> history;

    [[nodiscard]] bool may_be_there() const;
    [[nodiscard]] bool may_be_gone() const;
    [[nodiscard]] bool certain() const { return possible.size() == 1; }
  };

  /// A frame that is always there and that nobody changes.
  void fix(const std::string& id, const std::string& partition, const Place& place);

  // What was asked for, and whether it is known that it was done.
  void add(const std::string& id, const std::string& partition, const Place& place, bool done);
  void update(const std::string& id, const Transform& X_PC, bool done);
  void move(const std::string& id, const std::string& parent, const std::optional<Transform>& X_PC,
            bool done);
  void remove(const std::string& id, bool done);

  /// A change was made, perhaps, but could not be stored.
  void doubt(const std::string& id);

  /// It has turned out that a frame is not there, if that is possible.
  void gone(const std::string& id);

  /// Adds a line to what is told of a frame in a violation.
  void note(const std::string& id, const std::string& line);

  /// Those that are there or may be.
  [[nodiscard]] const std::map<std::string, Frame>& frames() const { return frames_; }
  /// Those that are gone for sure.
  [[nodiscard]] const std::map<std::string, Frame>& removed() const { return removed_; }
  /// One of either.
  [[nodiscard]] const Frame& frame(const std::string& id) const;

  /// Of those whose names begin so: the ones that may be there, or that are anchored.
  [[nodiscard]] std::vector<std::string> ids(const std::string& prefix, bool anchored) const;

  /// Whether a frame is there for sure, and all above it too, each where it is known to be.
  [[nodiscard]] bool anchored(const std::string& id) const;
  /// Whether a frame hangs below another, or may do so, or is that.
  [[nodiscard]] bool may_be_below(const std::string& id, const std::string& ancestor) const;

  /// Judges what a lookup of b in a gave; empty: an answer that one of the two is not there, or not
  /// connected. Drops the possibilities that an answer excludes.
  /// @param quiet  nobody can have anything to learn any more
  /// @return empty where one of the possible states has that answer; else what was expected
  [[nodiscard]] std::string judge(const std::string& a, const std::string& b,
                                  const std::optional<Transform>& X_AB, bool quiet);

 private:
  [[nodiscard]] bool goes_with(const std::string& id, const std::string& ancestor) const;
  /// The frames on all ways that the frame may have up to another one, with these two.
  [[nodiscard]] std::set<std::string> ways_up(const std::string& id,
                                              const std::string& ancestor) const;
  using State = std::map<std::string, std::optional<Place>>;

  [[nodiscard]] std::vector<std::string> closure(const std::string& a, const std::string& b) const;
  void each_state(const std::vector<std::string>& ids,
                  const std::function<void(const State&)>& see) const;

  std::map<std::string, Frame> frames_;
  std::map<std::string, Frame> removed_;
};

}  // namespace tfdude::faults
