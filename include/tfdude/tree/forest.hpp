#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tfdude/base/result.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// Whose an edge is, as a small number that the layer above gives a meaning to.
using Owner = std::uint32_t;

/// The edge's value is held in this very forest.
inline constexpr Owner kHeldHere = 0;

/// A frame by number: found once by id, then used without hashing. Stands for this one frame until it
/// is removed; a later frame of the same id gets another handle.
struct Handle {
  std::uint32_t slot = 0;
  std::uint32_t generation = 0;
};

/// A new value X_PC for the edge named by its child's id.
struct EdgeUpdate {
  std::string id;
  Transform X_PC;
};

/// The same by number.
struct HandleUpdate {
  Handle frame;
  Transform X_PC;
};

/// A run of edges on a path that one owner holds: X from `from` to `to`.
struct Segment {
  Owner owner = kHeldHere;
  std::string from;
  std::string to;
};

/// What is known of one frame besides its value.
struct FrameInfo {
  std::string id;
  std::string parent;  ///< empty: a root
  Owner owner = kHeldHere;
  bool attached = false;    ///< its parent is there
  std::uint64_t since = 0;  ///< when it was hung where it hangs, as whoever did it counts
};

/// A held edge that was written at some commit or later.
struct ChangedEdge {
  std::string id;
  Transform X_PC;
};

/// The coordinate frames that one process knows: a forest whose edges carry either a value (held here) or
/// only the owner who holds it.
///
/// A frame may name a parent that is not there (yet); it is then a root, and is connected when the
/// parent appears.
///
/// @par Thread safety  All functions may be called from any thread. Lookups, find, exists, info and frames
///   take no lock and never wait: every commit (of one edge or of many) pushes new versions of its edges
///   and becomes visible by one store, and a reader sees the forest as it was at one commit. Writers take
///   turns on a lock that no reader touches; children() and roots() take it too.
/// @par Memory  Superseded versions are reused as soon as no reader can see them (epochs, see epoch.hpp).
class Forest {
 public:
  Forest();
  ~Forest();
  Forest(const Forest&) = delete;
  Forest& operator=(const Forest&) = delete;

  enum class MissingParent { kRefuse, kAllow };

  // --- frames held here ---

  /// Adds a frame; an empty parent makes a root. O(1) for a leaf, O(n) where n frames wait for it.
  /// @return kAlreadyExists, kUnknownParent, kCycle, kInvalidInput (id, or a value that is not finite).
  [[nodiscard]] Result<void> add(std::string_view id, std::string_view parent,
                                 const Transform& X_PC, MissingParent rule = MissingParent::kRefuse,
                                 std::uint64_t since = 0);

  /// Removes a held frame and all held frames below it that are reached through held ones. O(removed).
  /// @return the removed ids; kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<std::vector<std::string>> remove(std::string_view id);

  /// Removes one held frame and nothing below it, what hangs there waits for another of that id.
  /// O(subtree). @return kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<void> release(std::string_view id);

  /// Gives an edge a new value. Allocation-free.
  /// @return kUnknownFrame, kNotOwner, kInvalidInput (not finite).
  [[nodiscard]] Result<void> update(std::string_view id, const Transform& X_PC);
  [[nodiscard]] Result<void> update(Handle frame, const Transform& X_PC);

  /// Gives many edges new values as one commit: all or, on an error, none; no reader sees a part.
  [[nodiscard]] Result<void> update(const std::vector<EdgeUpdate>& edges);
  [[nodiscard]] Result<void> update(const std::vector<HandleUpdate>& edges);

  /// Hangs a held frame, with all below it, under a new parent; empty makes it a root. Keeps the edge's
  /// value where X_PC is not given. O(subtree).
  /// @return kUnknownFrame, kNotOwner, kUnknownParent, kCycle, kInvalidInput (not finite).
  [[nodiscard]] Result<void> move(std::string_view id, std::string_view parent,
                                  const std::optional<Transform>& X_PC = std::nullopt,
                                  std::uint64_t since = 0);

  // --- frames held elsewhere: structure only ---

  /// Notes that `owner` holds a frame, new or known. A held frame is not touched.
  /// @return kAlreadyExists (it is held here), kCycle (kept as a root), kInvalidInput (id, owner).
  [[nodiscard]] Result<void> put_remote(std::string_view id, std::string_view parent, Owner owner,
                                        std::uint64_t since = 0);

  /// Forgets a frame if `owner` holds it.
  void drop_remote(std::string_view id, Owner owner);

  // --- reading ---

  /// X_AB. Allocation-free on success; O(depth of both below their common ancestor).
  /// @return kUnknownStart, kUnknownEnd, kNotConnected, kNotOwner (an edge on the path is held
  ///   elsewhere: see segments()).
  [[nodiscard]] Result<Transform> lookup(std::string_view a, std::string_view b) const;
  [[nodiscard]] Result<Transform> lookup(Handle a, Handle b) const;

  /// The same without its covariance, at a fraction of the time.
  [[nodiscard]] Result<Pose> lookup_pose(std::string_view a, std::string_view b) const;
  [[nodiscard]] Result<Pose> lookup_pose(Handle a, Handle b) const;

  /// As lookup, for a segment that somebody else's path needs: its ends may be frames that are not there,
  /// as long as held edges name them as their parent.
  [[nodiscard]] Result<Transform> lookup_segment(std::string_view from, std::string_view to) const;

  /// The path from a to b as runs of edges by owner, in order; empty where a is b.
  /// @return kUnknownStart, kUnknownEnd, kNotConnected.
  [[nodiscard]] Result<std::vector<Segment>> segments(std::string_view a, std::string_view b) const;

  [[nodiscard]] std::optional<Handle> find(std::string_view id) const;
  [[nodiscard]] bool exists(std::string_view id) const { return find(id).has_value(); }
  /// True for a frame held here. Allocation-free, lock-free: fit for a filter.
  [[nodiscard]] bool holds(std::string_view id) const;
  [[nodiscard]] std::optional<FrameInfo> info(std::string_view id) const;
  [[nodiscard]] std::optional<FrameInfo> info(Handle frame) const;
  /// The value of a held edge. @return kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<Transform> value(std::string_view id) const;

  /// All frames of one commit, in no particular order. O(n).
  [[nodiscard]] std::vector<FrameInfo> frames() const;
  /// The frame and all below it, whoever holds them; parents before children. Empty if unknown. O(result).
  [[nodiscard]] std::vector<FrameInfo> subtree(std::string_view id) const;
  /// Ids, sorted. @return kUnknownFrame.
  [[nodiscard]] Result<std::vector<std::string>> children(std::string_view id) const;
  /// Frames without a parent that is there, sorted.
  [[nodiscard]] std::vector<std::string> roots() const;
  /// Frames that name this one as their parent while it is not there. O(result).
  [[nodiscard]] std::vector<FrameInfo> waiting_for(std::string_view id) const;

  /// All held edges that were written since that commit, and the commit up to which this was looked for:
  /// what to ask for next. Takes no lock. O(slots).
  [[nodiscard]] std::pair<std::vector<ChangedEdge>, std::uint64_t> changed_since(
      std::uint64_t commit) const;

  /// Grows with every change of the structure (not of values).
  [[nodiscard]] std::uint64_t structure_version() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tfdude
