#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "tree/forest.hpp"

namespace tfdude {

struct HeldVersion;

/// The stamp of a value that holds for all times.
inline constexpr std::int64_t kAlways = INT64_MIN;

/// The stamp of a dynamic edge whose history was cleared, until its next sample; earlier than all
/// others.
inline constexpr std::int64_t kNoSample = kAlways + 1;

/// The history of one edge: its samples, ordered by stamp, in a ring buffer. Each sample is the
/// version that showed it first.
///
/// Samples are numbered; number n is in slot n modulo the capacity. Appending changes nothing that
/// a reader accesses: the reader starts at its version of the edge, which knows the number of its
/// own sample, and goes back from there. Other changes (growing, inserting) are made in a copy,
/// which the next version refers to. One writer at a time; readers need an epoch::Guard.
class SampleHistory {
 public:
  /// The two samples around an instant; null: none.
  struct Bracket {
    const HeldVersion* before = nullptr;
    const HeldVersion* after = nullptr;
  };

  explicit SampleHistory(const EdgeTiming& timing) : SampleHistory(timing, kFirstCapacity) {}

  [[nodiscard]] const EdgeTiming& timing() const { return timing_; }
  [[nodiscard]] bool has_noise() const { return has_noise_; }

  /// The samples around t. `newest` is the number of the newest sample that the reader sees, which
  /// is later than t.
  /// @param back  in: the distance from the newest sample found for an edge with similar sampling;
  ///   out: that for this edge
  /// @return empty if all are later. O(1) if the samples come at an even rate, otherwise O(log n).
  [[nodiscard]] Bracket around(std::int64_t t, std::uint64_t newest, std::uint64_t& back) const;

  /// The stamp of a sample that is still kept; otherwise kAlways.
  [[nodiscard]] std::int64_t stamp(std::uint64_t number) const;
  [[nodiscard]] HeldVersion* sample(std::uint64_t number) const;
  [[nodiscard]] std::uint64_t oldest() const { return first_.load(std::memory_order_acquire); }

  // --- writing ---

  [[nodiscard]] std::uint64_t next() const { return next_; }
  [[nodiscard]] std::uint64_t count() const {
    return next_ - first_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] bool full() const { return count() > mask_; }

  /// The number for a sample with this stamp; samples from that number on are later.
  [[nodiscard]] std::uint64_t place_of(std::int64_t stamp) const;

  /// There must be room, and no later sample.
  void append(HeldVersion* sample, std::int64_t stamp);

  /// Drops the oldest sample. @return the dropped sample
  [[nodiscard]] HeldVersion* drop_oldest();

  /// A copy with room for twice as many samples.
  [[nodiscard]] std::unique_ptr<SampleHistory> grown() const;

  /// A copy with one more sample, inserted at `place`.
  [[nodiscard]] std::unique_ptr<SampleHistory> with(HeldVersion* sample, std::int64_t stamp,
                                                    std::uint64_t place) const;

  /// A copy in which `sample` replaces one with the same stamp.
  [[nodiscard]] std::unique_ptr<SampleHistory> replaced(HeldVersion* sample,
                                                        std::uint64_t place) const;

  [[nodiscard]] std::size_t bytes() const {
    return sizeof(SampleHistory) + (mask_ + 1) * sizeof(Slot);
  }

  /// The commit of the last sample that was inserted or replaced. Set before readers see it.
  std::uint64_t rewritten = 0;

  std::uint64_t retire_tag = 0;

 private:
  static constexpr std::uint64_t kFirstCapacity = 8;
  struct Slot {
    std::atomic<std::int64_t> stamp{kAlways};
    std::atomic<HeldVersion*> sample{nullptr};
  };

  SampleHistory(const EdgeTiming& timing, std::uint64_t capacity)
      : timing_(timing),
        has_noise_(timing.process_noise.upper() != Covariance::Upper{}),
        mask_(capacity - 1),
        slots_(new Slot[capacity]) {}
  [[nodiscard]] std::unique_ptr<SampleHistory> empty_copy(std::uint64_t capacity) const;
  [[nodiscard]] Bracket pair(std::uint64_t before) const;
  [[nodiscard]] Slot& slot(std::uint64_t number) const { return slots_[number & mask_]; }
  [[nodiscard]] std::int64_t stamp_at(std::uint64_t number) const {
    return slot(number).stamp.load(std::memory_order_acquire);
  }

  const EdgeTiming timing_;
  const bool has_noise_;
  const std::uint64_t mask_;
  std::atomic<std::uint64_t> first_{0};
  std::uint64_t next_ = 0;
  std::unique_ptr<Slot[]> slots_;  // NOLINT(modernize-avoid-c-arrays): atomics cannot be moved
};

}  // namespace tfdude
