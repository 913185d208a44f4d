#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <variant>

#include "tfdude/base/result.hpp"

#include "tree/frames.hpp"
#include "tree/held_edge.hpp"

namespace tfdude {

/// A hash of what an owner and its readers must have in common: the sizes and places of all that a
/// reader follows, and how ids are hashed. Others cannot read each other's memory.
[[nodiscard]] std::uint64_t layout_hash();

/// An edge in the memory of its owner.
struct RemotePlace {
  const Head* head = nullptr;
  std::uint32_t attachment = 0;
};

class RemoteSamples;

/// The forest of another process, read in its memory (Arena). Writes nothing, takes no lock, and
/// follows only pointers that stay in the memory, whatever that contains; all loops end. What was
/// read is to be used only if intact() says so afterwards.
/// @par Thread safety  All functions are thread-safe.
class RemoteForest {
 public:
  /// @param memory  mapped here, aligned to 64, which outlives all that is read; its size must not
  ///   shrink
  /// @return kUnsupported: it is no such memory, or of another layout
  [[nodiscard]] static Result<RemoteForest> open(const void* memory, std::size_t size);

  /// The number of the newest commit.
  [[nodiscard]] std::uint64_t snapshot() const {
    return roots_->committed.load(std::memory_order_acquire);
  }
  /// What changes with each commit.
  [[nodiscard]] const std::atomic<std::uint64_t>& committed() const { return roots_->committed; }
  /// Whether what was read since then, at that commit, was overwritten by nothing.
  [[nodiscard]] bool intact(std::uint64_t snapshot) const {
    std::atomic_thread_fence(std::memory_order_acquire);
    return roots_->horizon.load(std::memory_order_relaxed) <= snapshot;
  }

  /// The edge from this frame to its parent at a commit. Empty if there is no such edge.
  [[nodiscard]] std::optional<RemotePlace> find(std::string_view id, std::string_view parent,
                                                std::uint64_t commit) const;

  /// As find(), of the newest commit up to this one at which there was such an edge, unless that
  /// has been overwritten.
  [[nodiscard]] std::optional<RemotePlace> find_former(std::string_view id, std::string_view parent,
                                                       std::uint64_t commit) const;
  /// The newest commit, up to this one, at which the edge was that one; 0: none.
  [[nodiscard]] std::uint64_t last_commit_of(const RemotePlace& place, std::uint64_t commit) const;

  /// The edge at a commit; null if it is another one by now, or cannot be read.
  [[nodiscard]] const HeldVersion* at(const RemotePlace& place, std::uint64_t commit) const {
    const HeldVersion* newest =
        here(static_cast<const HeldVersion*>(place.head->load(std::memory_order_acquire)));
    if (newest != nullptr && load(newest->commit) <= commit && is(*newest, place)) return newest;
    return older(place, commit);
  }

  /// An address of the owner as one of this process; null if no such object fits there.
  template <class T>
  [[nodiscard]] const T* here(const T* theirs, std::uint64_t count = 1) const {
    // NOLINTNEXTLINE(*-reinterpret-cast): it is a number until it is checked; null is beyond the end
    const std::uint64_t offset = reinterpret_cast<std::uint64_t>(theirs) - base_;
    const std::uint64_t bytes = sizeof(T) * count;  // the callers limit the count
    const bool fits = offset < size_ && bytes <= size_ - offset && offset % alignof(T) == 0;
    // NOLINTNEXTLINE(*-reinterpret-cast): checked above
    return fits ? reinterpret_cast<const T*>(memory_ + offset) : nullptr;
  }

  /// Once, and not again after it was checked: the memory may change at any time.
  template <class T>
  [[nodiscard]] static T load(const T& there) {
    T once;
    __atomic_load(&there, &once, __ATOMIC_RELAXED);
    return once;
  }

 private:
  RemoteForest(const SharedRoots& roots, std::size_t size)
      // NOLINTNEXTLINE(*-reinterpret-cast): of bytes
      : memory_(reinterpret_cast<const char*>(&roots)),
        size_(size),
        base_(roots.base),
        roots_(&roots) {}

  [[nodiscard]] static bool is(const Version& version, const RemotePlace& place) {
    return load(version.attachment) == place.attachment && load(version.owner) == kHeldHere;
  }
  [[nodiscard]] const Version* at(const Head& head, std::uint64_t commit) const;
  // As at(), if the newest version is not the one.
  [[nodiscard]] const HeldVersion* older(const RemotePlace& place, std::uint64_t commit) const;
  [[nodiscard]] const Head* head_of(std::uint32_t slot) const;
  // Of the frame with this name, which may be null, at the owner's address.
  [[nodiscard]] const Head* head_of(const Name* called) const;
  // A version, and the last commit at which it was that of its slot; null: there is none.
  struct Former {
    const Version* version = nullptr;
    std::uint64_t commit = 0;
  };
  // The newest version up to a commit of which is(version, its last commit) holds.
  template <class Is>
  [[nodiscard]] Former last_where(const Head& head, std::uint64_t commit, Is is) const;
  [[nodiscard]] std::string_view text_of(const Name* theirs) const;
  // The name of a frame, at the owner's address; null: it has none of this id.
  [[nodiscard]] const Name* name_of(std::string_view id) const;
  // Whether a version is of the frame with this name, below this parent, at a commit.
  [[nodiscard]] bool is_edge(const Version& version, const Name* called, std::string_view parent,
                             std::uint64_t commit) const;

  const char* memory_;
  std::size_t size_;
  std::uint64_t base_;
  const SharedRoots* roots_;
};

/// An edge in the memory of its owner, at a commit.
struct RemoteEdge {
  const HeldVersion* version = nullptr;
  const RemoteForest* forest = nullptr;
  std::size_t* common_errors_left = nullptr;  // that may still be read

  [[nodiscard]] inline RemoteSamples samples() const;

  // As of OwnEdge.
  using Copy = Correlation;
  [[nodiscard]] bool find_said(Copy& copy, const Correlation*& found) const {
    return version->correlation == nullptr || find(copy, found, false);
  }
  [[nodiscard]] bool find_now(Copy& copy, const Correlation*& found) const {
    return version->correlation == nullptr || find(copy, found, true);
  }

  /// Copies a correlation of the owner. @return false: it cannot be read, or there are too many
  [[nodiscard]] bool read(const FlatCorrelation* theirs, Correlation& copy) const;

 private:
  [[nodiscard]] bool find(Copy& copy, const Correlation*& found, bool now) const;
};

/// As OwnSamples, of an edge in the memory of its owner. What cannot be read counts as missing.
class RemoteSamples {
 public:
  explicit RemoteSamples(const RemoteEdge& edge);

  [[nodiscard]] bool has_noise() const { return there() && is_set(samples_->has_noise()); }
  [[nodiscard]] const Covariance& process_noise() const { return samples_->timing().process_noise; }
  [[nodiscard]] bool drifts() const { return there() && is_set(samples_->timing().drifts); }
  [[nodiscard]] std::uint64_t oldest() const { return there() ? samples_->oldest() : UINT64_MAX; }
  [[nodiscard]] const Sample* sample(std::uint64_t number) const;
  [[nodiscard]] SampleHistory::Bracket around(std::int64_t t, std::uint64_t newest,
                                              std::uint64_t& back) const {
    return there() ? samples_around(*this, t, newest, back) : SampleHistory::Bracket{};
  }
  [[nodiscard]] std::int64_t reach(std::uint64_t newest) const {
    return there() ? extrapolation_reach(*this, newest, samples_->made_up_end()) : 0;
  }
  [[nodiscard]] bool is_timed_since(std::int64_t t, std::uint64_t newest) const {
    return there() && timed_since(*this, t, newest, samples_->made_up_end());
  }
  [[nodiscard]] bool given_parts(const Sample& sample, TransformParts& parts) const;
  /// What samples refer to, copied, since it may change while it is used.
  struct Copies {
    struct One {
      Sample sample;
      std::variant<std::monostate, SharedCovariance, SharedJoint> shared;
    };
    One before;
    One after;
  };
  [[nodiscard]] bool make_whole(SampleHistory::Bracket& samples, Copies& copies) const;

 private:
  [[nodiscard]] bool there() const { return chunks_ != nullptr; }
  [[nodiscard]] bool copy(const Sample& sample, Copies::One& copy) const;

  // The memory may contain a byte that no truth value has.
  [[nodiscard]] static bool is_set(const bool& flag);

  const RemoteEdge& edge_;
  const RemoteForest& forest_;
  const SampleHistory* samples_ = nullptr;
  const std::atomic<SampleChunk*>* chunks_ = nullptr;
  std::uint64_t mask_ = 0;
};

inline RemoteSamples RemoteEdge::samples() const { return RemoteSamples(*this); }

}  // namespace tfdude
