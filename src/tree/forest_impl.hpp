#pragma once

#include <mutex>

#include "tfdude/tree/forest.hpp"

#include "tree/epoch.hpp"
#include "tree/graph.hpp"
#include "tree/id_table.hpp"
#include "tree/versions.hpp"
#include "tree/write_lock.hpp"

namespace tfdude {

/// The shared state of Forest: what readers see (ids_, slots_, committed_) and what writers keep beside it
/// under mutex_ (graph_, free slots, pools).
///
/// A commit pushes a new version on each slot it concerns, all with the next commit number, then stores
/// that number. A reader takes the number once and skips newer versions, so it sees all of a commit or
/// nothing of it.
class Forest::Impl {
 public:
  // --- reading, under an epoch::Guard (forest_read.cpp) ---

  [[nodiscard]] std::uint64_t snapshot() const {
    return committed_.load(std::memory_order_seq_cst);
  }

  /// What the slot held at that commit.
  [[nodiscard]] static const Version* at(const Head& head, std::uint64_t commit) {
    const Version* version = head.load(std::memory_order_acquire);
    while (version->commit > commit) version = version->older;
    return version;
  }
  [[nodiscard]] const Version* at(std::uint32_t slot, std::uint64_t commit) const {
    return at(slots_[slot], commit);
  }

  /// The version of the id's slot at that commit; null if no slot stood for the id then.
  [[nodiscard]] const Version* named(std::string_view id, std::uint64_t commit) const;

  /// The same where the frame was there.
  [[nodiscard]] const Version* present(std::string_view id, std::uint64_t commit) const {
    const Version* version = named(id, commit);
    return version != nullptr && version->present() ? version : nullptr;
  }

  /// The version of the handle's frame at that commit; null if it was not there.
  [[nodiscard]] const Version* of(Handle frame, std::uint64_t commit) const;

  /// Both ends climb to where they meet. Frames that are not there end the climb, or may be passed.
  enum class Absent { kEnds, kMayPass };
  template <class Value>
  [[nodiscard]] Result<Value> walk(const Version* a, const Version* b, std::uint64_t commit,
                                   Absent absent) const;

  /// From handle to handle; Value is Transform, or Pose where the covariance is not asked for.
  template <class Value>
  [[nodiscard]] Result<Value> look_up(Handle a, Handle b) const;
  template <class Value>
  [[nodiscard]] Result<Value> look_up(std::string_view a, std::string_view b) const;

  [[nodiscard]] FrameInfo info_of(const Version& version, std::uint64_t commit) const;

  // --- writing, under mutex_ (forest_write.cpp) ---

  /// The newest version, that of the commit being made where there is one.
  [[nodiscard]] const Version& newest(std::uint32_t slot) const {
    return *slots_[slot].load(std::memory_order_relaxed);
  }

  /// The id's newest version, there or not; null if the id is not interned.
  [[nodiscard]] const Version* newest_named(std::string_view id) const;

  /// Checks that the frame is there and held here. @return kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<std::uint32_t> held_slot(std::string_view id) const;
  [[nodiscard]] Result<std::uint32_t> held_slot(Handle frame) const;
  /// The newest version of the frame if it is held here, else null.
  [[nodiscard]] const Version* newest_held(Handle frame) const {
    if (frame.slot >= slots_.size()) return nullptr;
    const Version& version = newest(frame.slot);
    return version.held() && version.generation == frame.generation ? &version : nullptr;
  }

  /// All of them as one commit, or none; `frame` gives the id or the handle of an update.
  template <class Update, class Frame>
  [[nodiscard]] Result<void> update_all(const std::vector<Update>& edges, Frame frame);

  /// The newest versions of an id and of the parent that it is to have; null where not interned.
  struct Pair {
    std::string_view id;
    std::string_view parent;
    const Version* frame;
    const Version* above;
  };
  [[nodiscard]] Pair newest_pair(std::string_view id, std::string_view parent) const;

  /// Checks that the frame may hang under the parent (empty: under nothing). @return kCycle.
  [[nodiscard]] Result<void> check_no_cycle(const Pair& pair) const;

  /// The parent's slot, a new absent one if the id is not interned; kNoSlot for an empty id.
  std::uint32_t parent_slot(const Pair& pair);

  /// A name for an id that is not interned, on a slot whose next version is to have it.
  const Name* intern(std::string_view id);

  /// Pushes copies of the newest version, to be changed before commit().
  HeldVersion& push_held(std::uint32_t slot, const Transform& X_PC);
  Version& push_remote(std::uint32_t slot);

  /// Hangs the slot, whose fresh version this is, under another parent (kNoSlot: none).
  void relink(Version& fresh, std::uint32_t parent);

  /// Makes the frame in the slot not be there; those below it become roots.
  void make_absent(std::uint32_t slot);

  /// Makes all that was pushed visible at once.
  void commit();
  void commit_structure();

  SlotArray slots_;
  std::atomic<std::uint64_t> structure_version_{0};
  mutable WriteLock mutex_;
  Graph graph_;

 private:
  // How many superseded versions may wait before the readers are asked: rare enough to cost little (locked
  // instructions, and the readers' cache lines), few enough that the pool stays in the first-level cache.
  static constexpr std::size_t kCollectAt = 64;

  template <class T>
  T& push(VersionPool<T>& pool, std::uint32_t slot);
  void hang(Version& fresh, std::uint32_t parent) const;
  void renew_depths(std::uint32_t top);
  void release(Version& fresh);
  void release_if_unused(std::uint32_t slot);
  void collect();

  IdTable ids_;
  std::atomic<std::uint64_t> committed_{0};
  VersionPool<HeldVersion> held_pool_;
  VersionPool<Version> remote_pool_;
  std::vector<Version*> superseded_;         // by commits since the readers were last asked
  std::vector<const Name*> released_names_;  // by the commit being made
  std::vector<std::uint32_t> free_slots_;
  std::vector<std::uint32_t> to_update_;  // of the update being made; kept for its memory
  std::uint32_t next_generation_ = 1;
};

}  // namespace tfdude
