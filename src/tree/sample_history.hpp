#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "tree/forest.hpp"
#include "tree/sample.hpp"
#include "tree/sample_store.hpp"

namespace tfdude {

/// The history of one edge: its samples, ordered by stamp, in chunks. A ring buffer points to the
/// chunks.
///
/// Samples are numbered; number n is in the chunk with number n / kSize, whose pointer is in slot
/// n / kSize modulo the capacity. Appending changes nothing that a reader accesses: the reader
/// starts at its version of the edge, which knows the number of its newest sample, and goes back
/// from there. A chunk is reused only when no reader can see it any more, so what was found stays
/// valid. Other changes (growing, inserting) are made in a copy, which the next version refers to;
/// the copy shares the chunks that do not change. One writer at a time; readers need an
/// epoch::Guard.
class SampleHistory {
 public:
  /// The two samples around an instant; null: none.
  struct Bracket {
    const Sample* before = nullptr;
    const Sample* after = nullptr;
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

  /// The value at an instant between two consecutive samples, with process noise.
  [[nodiscard]] Transform value_between(const Sample& before, const Sample& after,
                                        std::int64_t t) const;

  /// Null if the sample is not kept any more.
  [[nodiscard]] const Sample* sample(std::uint64_t number) const {
    const std::uint64_t index = number / SampleChunk::kSize;
    const SampleChunk* chunk = chunks_[index & mask_].load(std::memory_order_acquire);
    // Another one may have taken its slot.
    const bool there = chunk != nullptr && chunk->first == index * SampleChunk::kSize;
    return there ? &chunk->samples[number % SampleChunk::kSize] : nullptr;
  }
  /// Its stamp; kAlways if it is not kept any more.
  [[nodiscard]] std::int64_t stamp(std::uint64_t number) const {
    const Sample* found = sample(number);
    return found != nullptr && oldest() <= number ? found->stamp : kAlways;
  }
  [[nodiscard]] std::uint64_t oldest() const { return first_.load(std::memory_order_acquire); }

  /// Its memory, without samples.
  [[nodiscard]] std::size_t bytes() const {
    return sizeof(SampleHistory) + (mask_ + 1) * sizeof(SampleChunk*);  // NOLINT(*-sizeof-*)
  }
  /// The memory of the samples up to this one. O(samples).
  [[nodiscard]] std::size_t bytes_until(std::uint64_t newest) const;

  // --- writing ---

  [[nodiscard]] std::uint64_t next() const { return next_; }
  [[nodiscard]] std::uint64_t count() const {
    return next_ - first_.load(std::memory_order_relaxed);
  }
  /// Whether there is no room for another sample.
  [[nodiscard]] bool full() const {
    const std::uint64_t first = first_.load(std::memory_order_relaxed);
    return next_ / SampleChunk::kSize - first / SampleChunk::kSize > mask_;
  }

  /// Whether there are instants_between() the sample before this place and that at it. Watchers
  /// were sent their values. If a sample changes these, the watchers have to forget them: this is
  /// another history to them. It is sent again, but is short, as so are those of joints that turn
  /// far from sample to sample.
  [[nodiscard]] bool has_instants(std::uint64_t place) const {
    return place > oldest() && place < next_ &&
           !instants_between(*at(place - 1), *at(place)).empty();
  }

  /// The number for a sample with this stamp; samples from that number on are later.
  [[nodiscard]] std::uint64_t place_of(std::int64_t stamp) const;

  /// Adds a sample of a commit, later than all others. There must be room.
  void append(std::int64_t stamp, std::uint64_t commit, const GivenValue& value,
              SampleStore& store) {
    const bool is_first = count() == 0;
    Sample& sample = add(store);
    sample.stamp = stamp;
    sample.commit = commit;
    sample.shared = ends_.newest_shared = store.share(value, ends_.newest_shared);
    sample.set(value);
    if (is_first) find_first();
  }

  [[nodiscard]] std::int64_t first_stamp() const { return ends_.first_stamp; }

  /// Drops the oldest sample, but not the only one.
  void drop_oldest(SampleStore& store) {
    const std::uint64_t first = first_.load(std::memory_order_relaxed);
    store.release(ends_.first_shared);
    if (is_last_of_chunk(first)) store.supersede(chunk(first));
    first_.store(first + 1, std::memory_order_release);
    find_first();
  }

  /// Drops all samples, when the whole history is superseded.
  void drop_all(SampleStore& store) const;

  /// A copy with room for twice as many samples.
  [[nodiscard]] std::unique_ptr<SampleHistory> grown() const;

  /// A copy with one more sample, inserted at `place`, which is not after the newest.
  [[nodiscard]] std::unique_ptr<SampleHistory> with(const Sample& sample, std::uint64_t place,
                                                    SampleStore& store) const;

  /// A copy in which `sample` replaces one with the same stamp.
  [[nodiscard]] std::unique_ptr<SampleHistory> replaced(const Sample& sample, std::uint64_t place,
                                                        SampleStore& store) const;

  /// Replaces a sample that no reader can see yet.
  void rewrite(const Sample& sample, std::uint64_t place) {
    *at(place) = sample;
    find_ends();
  }

  /// The commit of the last sample that was inserted or replaced. Set before readers see it.
  std::uint64_t rewritten = 0;

  /// Its only sample is the last one of an earlier process. What was between that and the next
  /// sample nobody has measured, so the next one begins another history. Set before readers see it.
  bool left_behind = false;

  std::uint64_t retire_tag = 0;

 private:
  static constexpr std::uint64_t kFirstCapacity = 2;

  SampleHistory(const EdgeTiming& timing, std::uint64_t capacity);
  // A copy that shares the chunks of the samples before this one; they must end there.
  [[nodiscard]] std::unique_ptr<SampleHistory> copy(std::uint64_t capacity,
                                                    std::uint64_t end) const;
  [[nodiscard]] SampleChunk* chunk(std::uint64_t number) const {
    return chunks_[(number / SampleChunk::kSize) & mask_].load(std::memory_order_relaxed);
  }
  [[nodiscard]] Sample* at(std::uint64_t number) const {
    return &chunk(number)->samples[number % SampleChunk::kSize];
  }
  [[nodiscard]] bool is_last_of_chunk(std::uint64_t number) const {
    return number % SampleChunk::kSize == SampleChunk::kSize - 1 || number + 1 == next_;
  }
  [[nodiscard]] Sample& add(SampleStore& store) {
    if (count() == 0 || next_ % SampleChunk::kSize == 0) {
      ends_.newest = store.take_chunk();
      ends_.newest->first = next_ - next_ % SampleChunk::kSize;
      put(ends_.newest);
    }
    return ends_.newest->samples[next_++ % SampleChunk::kSize];
  }
  void find_first() {
    const Sample& first = *at(first_.load(std::memory_order_relaxed));
    ends_.first_stamp = first.stamp;
    ends_.first_shared = first.shared;
  }
  void find_ends() {
    if (count() == 0) return;
    find_first();
    ends_.newest = chunk(next_ - 1);
    ends_.newest_shared = at(next_ - 1)->shared;
  }
  void put(SampleChunk* chunk) {
    chunks_[(chunk->first / SampleChunk::kSize) & mask_].store(chunk, std::memory_order_release);
  }

  // What the writer needs of the oldest and the newest sample. It is read before that, so that the
  // writer need not wait for memory that it last used some thousand samples ago.
  struct Ends {
    std::int64_t first_stamp = kAlways;
    const SharedPart* first_shared = nullptr;
    SampleChunk* newest = nullptr;
    const SharedPart* newest_shared = nullptr;
  };

  const EdgeTiming timing_;
  const bool has_noise_;
  const std::uint64_t mask_;
  std::atomic<std::uint64_t> first_{0};
  std::uint64_t next_ = 0;
  Ends ends_;
  // NOLINTNEXTLINE(modernize-avoid-c-arrays): atomics cannot be moved
  std::unique_ptr<std::atomic<SampleChunk*>[]> chunks_;
};

}  // namespace tfdude
