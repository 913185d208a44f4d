#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/saturating.hpp"
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

  /// Destroys a history, and releases its memory. Null: does nothing.
  static void destroy(SampleHistory* samples);
  struct Destroy {
    void operator()(SampleHistory* samples) const { destroy(samples); }
  };
  using Pointer = std::unique_ptr<SampleHistory, Destroy>;

  [[nodiscard]] static Pointer create(Arena& arena, const EdgeTiming& timing) {
    return create(arena, timing, kFirstCapacity);
  }
  SampleHistory(const SampleHistory&) = delete;
  SampleHistory& operator=(const SampleHistory&) = delete;

  [[nodiscard]] const EdgeTiming& timing() const { return timing_; }
  [[nodiscard]] const bool& has_noise() const { return has_noise_; }

  /// The samples around t. `newest` is the number of the newest sample that the reader sees, which
  /// is later than t.
  /// @param back  in: the distance from the newest sample found for an edge with similar sampling;
  ///   out: that for this edge
  /// @return empty if all are later. O(1) if the samples come at an even rate, otherwise O(log n).
  [[nodiscard]] Bracket around(std::int64_t t, std::uint64_t newest, std::uint64_t& back) const;

  /// The value at an instant between two consecutive samples, with process noise.
  [[nodiscard]] Transform value_between(const Sample& before, const Sample& after,
                                        std::int64_t t) const;

  /// How far beyond its newest sample the edge may be extrapolated [ns]: as far as the two newest
  /// samples that the reader sees carry it. 0: it cannot be, as there is only one, or as the owner
  /// has made up a stamp of them.
  [[nodiscard]] std::int64_t reach(std::uint64_t newest) const;
  /// The number after the newest sample whose stamp the owner has made up; 0: there is none.
  [[nodiscard]] std::uint64_t made_up_end() const {
    return made_up_end_.load(std::memory_order_relaxed);
  }

  /// Whether what the edge did around an instant, up to its newest sample, is known by stamps that
  /// came with the samples.
  [[nodiscard]] bool is_timed_since(std::int64_t t, std::uint64_t newest) const;

  /// Whether its owner has made up the stamp of this sample, which is the newest of those.
  [[nodiscard]] bool made_up(std::uint64_t number) const {
    return made_up_end_.load(std::memory_order_relaxed) == number + 1;
  }

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

  // --- for readers in other processes, of which each has its own addresses

  [[nodiscard]] const std::uint64_t& mask() const { return mask_; }
  [[nodiscard]] std::atomic<SampleChunk*>* const& chunks() const { return chunks_; }
  /// A number that differs if the fields have other places.
  [[nodiscard]] static std::uint64_t layout();

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

  /// The stamp of this sample, the newest, is one that its owner has made up: when it arrived. The
  /// time between such stamps was not measured, so it tells no velocity.
  void set_made_up(std::uint64_t number) {
    made_up_end_.store(number + 1, std::memory_order_relaxed);
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
  /// Adds a sample that another history has given up to this one.
  void append(const Sample& sample, SampleStore& store) {
    const bool is_first = count() == 0;
    add(store) = sample;
    ends_.newest_shared = sample.shared;
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
  [[nodiscard]] Pointer grown() const;

  /// A copy with one more sample, inserted at `place`, which is not after the newest.
  [[nodiscard]] Pointer with(const Sample& sample, std::uint64_t place, SampleStore& store) const;

  /// A copy in which these samples replace consecutive ones with the same stamps.
  /// @param place  number of the first of them
  [[nodiscard]] Pointer replaced(const std::vector<Sample>& samples, std::uint64_t place,
                                 SampleStore& store) const;

  /// Consecutive samples: from the number `first` up to that before `end`.
  struct Range {
    std::uint64_t first = 0;
    std::uint64_t end = 0;
  };
  /// The samples before a range, which is dropped with its samples. This history is superseded: the
  /// samples after the range must be appended to the copy, after those that take its place.
  /// @param room  how many samples the copy must have room for, besides
  [[nodiscard]] Pointer without(const Range& range, std::uint64_t room, SampleStore& store) const;
  /// As the history of an edge from which it was made by replacing a range of samples by others.
  /// @param history  the edge's number of that history
  /// @param kept_before  all samples before this instant are as they were
  void continue_from(const SampleHistory& before, const Range& replaced, std::uint64_t history,
                     std::int64_t kept_before);

  /// The instant before which all is as in this earlier history of the edge; kAlways: not known.
  [[nodiscard]] std::int64_t kept_before(std::uint64_t history) const;
  /// Earlier histories of the edge have nothing in common with this one any more.
  void forget_earlier() { earlier_ = {}; }

  /// Replaces a sample that no reader can see yet.
  void rewrite(const Sample& sample, std::uint64_t place) {
    *at(place) = sample;
    find_ends();
  }

  /// The commit of the last sample that was inserted or replaced. Set before readers see it.
  std::uint64_t rewritten = 0;

  /// The commit of the last observation of the edge: samples that an earlier one has corrected were
  /// left out of it.
  [[nodiscard]] std::uint64_t observed() const { return observed_.load(std::memory_order_relaxed); }
  void set_observed(std::uint64_t commit) { observed_.store(commit, std::memory_order_relaxed); }

  /// Its only sample is the last one of an earlier process. What was between that and the next
  /// sample nobody has measured, so the next one begins another history. Set before readers see it.
  bool left_behind = false;

  std::uint64_t retire_tag = 0;

 private:
  static constexpr std::uint64_t kFirstCapacity = 2;

  [[nodiscard]] static Pointer create(Arena& arena, const EdgeTiming& timing,
                                      std::uint64_t capacity);
  SampleHistory(Arena& arena, const EdgeTiming& timing, std::uint64_t capacity);
  ~SampleHistory() = default;
  // A copy that shares the chunks of the samples before this one; they must end there.
  [[nodiscard]] Pointer copy(std::uint64_t capacity, std::uint64_t end) const;
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

  // An earlier history of the edge, of which a rewrite has kept the beginning.
  struct Earlier {
    std::uint64_t history = 0;  // 0: none
    std::int64_t kept_before = kAlways;
  };

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
  // The stamps of samples from this number on came with them.
  std::atomic<std::uint64_t> made_up_end_{0};
  std::atomic<std::uint64_t> observed_{0};
  std::uint64_t next_ = 0;
  Ends ends_;
  // The last ones, newest first: enough for watchers that get what is new many times a second.
  std::array<Earlier, 4> earlier_;
  const Veiled<Arena> arena_;
  std::atomic<SampleChunk*>* const chunks_;
};

/// As SampleHistory::around(), of samples that may be in the memory of another process.
template <class Samples>
SampleHistory::Bracket samples_around(const Samples& samples, std::int64_t t, std::uint64_t newest,
                                      std::uint64_t& back) {
  // How far a guess may be off before bisection is faster.
  constexpr int kSteps = 4;
  std::uint64_t low = samples.oldest();
  std::uint64_t high = newest;
  if (back > 0 && back <= high - low) {
    const Sample* before = samples.sample(high - back);
    const Sample* after = samples.sample(high - back + 1);
    const bool both = before != nullptr && after != nullptr;
    if (both && before->stamp <= t && t < after->stamp) return {before, after};
  }
  const Sample* before = samples.sample(low);
  const Sample* after = samples.sample(high);
  if (low >= high || after == nullptr || (before != nullptr && t < before->stamp)) return {};
  std::uint64_t at = low;
  if (before != nullptr) {
    const double share = static_cast<double>(saturating_subtract(t, before->stamp)) /
                         static_cast<double>(saturating_subtract(after->stamp, before->stamp));
    // Otherwise what another process has written makes no sense.
    if (share >= 0 && share <= 1) {
      at += static_cast<std::uint64_t>(share * static_cast<double>(high - low));
    }
  }
  for (int step = 0; high - low > 1; ++step) {
    if (step >= kSteps) at = low + (high - low) / 2;
    at = std::clamp(at, low + 1, high - 1);
    const Sample* here = samples.sample(at);
    if (here == nullptr || here->stamp <= t) {
      before = here;
      low = at++;
    } else {
      after = here;
      high = at--;
    }
  }
  back = newest - low;
  return before != nullptr ? SampleHistory::Bracket{before, after} : SampleHistory::Bracket{};
}

/// As SampleHistory::reach(), likewise.
template <class Samples>
std::int64_t extrapolation_reach(const Samples& samples, std::uint64_t newest,
                                 std::uint64_t made_up_end) {
  // An error of a sample is twice as many times as large there.
  constexpr std::int64_t kMostIntervals = 100;
  if (newest <= samples.oldest() || made_up_end >= newest) return 0;
  const Sample* before = samples.sample(newest - 1);
  const Sample* after = samples.sample(newest);
  if (before == nullptr || after == nullptr) return 0;
  const std::int64_t interval = saturating_subtract(after->stamp, before->stamp);
  if (interval <= 0) return 0;  // what another process has written makes no sense
  return interval > INT64_MAX / kMostIntervals ? INT64_MAX : kMostIntervals * interval;
}

/// As SampleHistory::is_timed_since().
template <class Samples>
bool timed_since(const Samples& samples, std::int64_t t, std::uint64_t newest,
                 std::uint64_t made_up_end) {
  if (made_up_end <= samples.oldest()) return true;
  const Sample* first = made_up_end <= newest ? samples.sample(made_up_end) : nullptr;
  return first != nullptr && first->stamp <= t;
}

}  // namespace tfdude
