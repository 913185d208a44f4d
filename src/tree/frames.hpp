#pragma once

#include <atomic>
#include <cstdint>
#include <string_view>

#include "tree/forest.hpp"
#include "tree/id_table.hpp"
#include "tree/versions.hpp"

namespace tfdude {

/// The two ends of a path in one commit.
struct Ends {
  const Version* a;
  const Version* b;
  std::uint64_t commit;
};

[[nodiscard]] tl::unexpected<Error> unknown_start(std::string_view id);
[[nodiscard]] tl::unexpected<Error> unknown_end(std::string_view id);
/// Names the parent that a frame waits for, if that is why.
[[nodiscard]] tl::unexpected<Error> not_connected(const Ends& ends);

/// What readers of a forest see: the slot of each id, the versions of each slot, and the number of
/// the newest commit.
///
/// A commit pushes a new version on each slot it concerns, all with the next commit number, then
/// stores that number. A reader takes the number once and skips newer versions, so it sees a commit
/// whole or not at all.
///
/// @par Thread safety  Readers need an epoch::Guard, but no lock; one writer at a time.
class Frames {
 public:
  explicit Frames(Arena& arena) : slots_(arena), ids_(arena), committed_(arena.roots().committed) {}

  // --- reading ---

  [[nodiscard]] std::uint64_t snapshot() const {
    return committed_.load(std::memory_order_seq_cst);
  }

  /// The number of slots.
  [[nodiscard]] std::uint32_t size() const { return slots_.size(); }

  /// The version of the slot at that commit.
  [[nodiscard]] static const Version* at(const Head& head, std::uint64_t commit) {
    const Version* version = head.load(std::memory_order_acquire);
    while (version->commit > commit) version = version->older;
    return version;
  }
  [[nodiscard]] const Version* at(std::uint32_t slot, std::uint64_t commit) const {
    return at(slots_[slot], commit);
  }

  /// The version of the id's slot at that commit; null if no slot had the id then.
  [[nodiscard]] const Version* named(std::string_view id, std::uint64_t commit) const;

  /// As named(); null also if the frame was absent.
  [[nodiscard]] const Version* present(std::string_view id, std::uint64_t commit) const {
    const Version* version = named(id, commit);
    return version != nullptr && version->present() ? version : nullptr;
  }

  /// The version of the handle's frame at that commit; null if it did not exist.
  [[nodiscard]] const Version* of(Handle frame, std::uint64_t commit) const;

  /// @return kUnknownStart, kUnknownEnd.
  [[nodiscard]] Result<Ends> ends(std::string_view a, std::string_view b) const;
  [[nodiscard]] Result<Ends> ends(Handle a, Handle b) const;

  /// The version of a held edge in the newest commit. @return kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<const HeldVersion*> held_value(std::string_view id) const;

  [[nodiscard]] FrameInfo info_of(const Version& version, std::uint64_t commit) const;

  // --- for the writer ---

  /// The newest version: that of the current commit, if it has one.
  [[nodiscard]] const Version& newest(std::uint32_t slot) const {
    return *slots_[slot].load(std::memory_order_relaxed);
  }
  [[nodiscard]] const HeldVersion& newest_value(std::uint32_t slot) const {
    return static_cast<const HeldVersion&>(newest(slot));
  }

  /// The id's newest version, present or not; null if the id is not interned.
  [[nodiscard]] const Version* newest_named(std::string_view id) const;

  /// The newest version of the frame if it is held here, otherwise null.
  [[nodiscard]] const HeldVersion* newest_held(Handle frame) const {
    if (frame.slot >= slots_.size()) return nullptr;
    const Version& version = newest(frame.slot);
    return version.held() && version.generation == frame.generation
               ? static_cast<const HeldVersion*>(&version)
               : nullptr;
  }
  [[nodiscard]] const HeldVersion* newest_held(std::string_view id) const {
    const Version* version = newest_named(id);
    return version != nullptr && version->held() ? static_cast<const HeldVersion*>(version)
                                                 : nullptr;
  }

  /// Checks that the frame exists and is held here. @return kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<std::uint32_t> held_slot(std::string_view id) const;
  [[nodiscard]] Result<std::uint32_t> held_slot(Handle frame) const;

  [[nodiscard]] Head& head(std::uint32_t slot) const { return slots_[slot]; }
  std::uint32_t add_slot(Version* first) { return slots_.append(first); }
  const Name* add_name(std::string_view id, std::uint32_t slot) { return ids_.insert(id, slot); }
  void drop_name(const Name* name) { ids_.erase(name); }
  /// See IdTable::collect().
  void collect_names(std::uint64_t tag, std::uint64_t safe_below) { ids_.collect(tag, safe_below); }

  /// The number of the current commit.
  [[nodiscard]] std::uint64_t commit_being_made() const {
    return committed_.load(std::memory_order_relaxed) + 1;
  }
  /// Makes everything pushed visible at once.
  void show_commit() { committed_.store(commit_being_made(), std::memory_order_release); }
  /// Repeats the store of the last commit, in the order of the readers' announcements (epoch.hpp).
  void order_commit() { committed_.fetch_add(0, std::memory_order_seq_cst); }

 private:
  SlotArray slots_;
  IdTable ids_;
  std::atomic<std::uint64_t>& committed_;
};

}  // namespace tfdude
