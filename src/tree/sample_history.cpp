#include "tree/sample_history.hpp"

#include <algorithm>
#include <memory>
#include <new>

namespace tfdude {
namespace {

constexpr std::uint64_t kSize = SampleChunk::kSize;

}  // namespace

SampleHistory::SampleHistory(Arena& arena, const EdgeTiming& timing, std::uint64_t capacity)
    : timing_(timing),
      has_noise_(timing.process_noise.upper() != Covariance::Upper{}),
      mask_(capacity - 1),
      arena_(&arena),
      chunks_(static_cast<std::atomic<SampleChunk*>*>(
          arena.allocate(capacity * sizeof(std::atomic<SampleChunk*>)))) {
  std::uninitialized_value_construct_n(chunks_, capacity);
}

SampleHistory::Pointer SampleHistory::create(Arena& arena, const EdgeTiming& timing,
                                             std::uint64_t capacity) {
  return Pointer(new (arena.allocate(sizeof(SampleHistory)))
                     SampleHistory(arena, timing, capacity));
}

void SampleHistory::destroy(SampleHistory* samples) {
  if (samples == nullptr) return;
  Arena& arena = *samples->arena_;
  arena.release(samples->chunks_, (samples->mask_ + 1) * sizeof(samples->chunks_[0]));
  samples->~SampleHistory();
  arena.release(samples, sizeof(SampleHistory));
}

// A sample that is dropped meanwhile stays as it is until this reader has left. But another one may
// take its place: it then counts as earlier than t.
SampleHistory::Bracket SampleHistory::around(std::int64_t t, std::uint64_t newest,
                                             std::uint64_t& back) const {
  return samples_around(*this, t, newest, back);
}

std::int64_t SampleHistory::reach(std::uint64_t newest) const {
  return extrapolation_reach(*this, newest, made_up_end());
}

std::uint64_t SampleHistory::layout() {
  Arena arena;
  const Pointer one = create(arena, {});
  const auto place = [&one](const auto& field) {
    // NOLINTNEXTLINE(*-reinterpret-cast): addresses only
    return reinterpret_cast<std::uintptr_t>(&field) - reinterpret_cast<std::uintptr_t>(one.get());
  };
  std::uint64_t all = 0;
  for (const std::uintptr_t at :
       {place(one->timing_), place(one->has_noise_), place(one->mask_), place(one->first_),
        place(one->made_up_end_), place(one->chunks_)}) {
    all = all * 1024 + at;
  }
  return all;
}

bool SampleHistory::is_timed_since(std::int64_t t, std::uint64_t newest) const {
  return timed_since(*this, t, newest, made_up_end());
}

Transform SampleHistory::value_between(const Sample& before, const Sample& after,
                                       std::int64_t t) const {
  const auto span = static_cast<double>(after.stamp - before.stamp);
  const double s = static_cast<double>(t - before.stamp) / span;
  Transform X;
  interpolate(before, after, s, X);
  if (has_noise_ && X.covariance.complete()) {
    Covariance::Upper noise = timing_.process_noise.upper();
    for (double& number : noise) number *= s * (1.0 - s) * span * 1e-9;
    X.covariance += Covariance::trusted(noise);
  }
  return X;
}

std::size_t SampleHistory::bytes_until(std::uint64_t newest) const {
  const std::uint64_t first = oldest();
  std::size_t total = (newest / kSize + 1 - first / kSize) * sizeof(SampleChunk);
  const SharedPart* last = nullptr;
  for (std::uint64_t number = first; number <= newest; ++number) {
    const Sample* found = sample(number);
    if (found == nullptr) continue;
    if (found->shared != last) total += bytes_of(*found->shared);
    last = found->shared;
  }
  return total;
}

std::uint64_t SampleHistory::place_of(std::int64_t stamp) const {
  std::uint64_t low = first_.load(std::memory_order_relaxed);
  std::uint64_t high = next_;
  while (low < high) {
    const std::uint64_t middle = low + (high - low) / 2;
    if (at(middle)->stamp < stamp) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

// Readers of earlier commits still see them, so the range stays.
void SampleHistory::drop_all(SampleStore& store) const {
  for (std::uint64_t number = oldest(); number < next_; ++number) {
    store.release(at(number)->shared);
    if (is_last_of_chunk(number)) store.supersede(chunk(number));
  }
}

SampleHistory::Pointer SampleHistory::copy(std::uint64_t capacity, std::uint64_t end) const {
  Pointer copy = create(*arena_, timing_, capacity);
  const std::uint64_t first = oldest();
  copy->rewritten = rewritten;
  copy->set_observed(observed());
  copy->left_behind = left_behind;
  copy->earlier_ = earlier_;
  copy->made_up_end_.store(made_up_end_.load(std::memory_order_relaxed), std::memory_order_relaxed);
  copy->first_.store(first, std::memory_order_relaxed);
  copy->next_ = std::max(first, end);
  for (std::uint64_t number = first; number < end; number += kSize - number % kSize) {
    copy->put(chunk(number));
  }
  copy->find_ends();
  return copy;
}

SampleHistory::Pointer SampleHistory::grown() const { return copy(2 * (mask_ + 1), next_); }

SampleHistory::Pointer SampleHistory::with(const Sample& sample, std::uint64_t place,
                                           SampleStore& store) const {
  auto with_one = copy(full() ? 2 * (mask_ + 1) : mask_ + 1, place - place % kSize);
  if (place < made_up_end_.load(std::memory_order_relaxed)) ++with_one->made_up_end_;
  for (std::uint64_t number = with_one->next_; number < next_; ++number) {
    if (number == place) with_one->add(store) = sample;
    with_one->add(store) = *at(number);
    if (is_last_of_chunk(number)) store.supersede(chunk(number));
  }
  with_one->find_ends();
  return with_one;
}

SampleHistory::Pointer SampleHistory::without(const Range& range, std::uint64_t room,
                                              SampleStore& store) const {
  std::uint64_t capacity = mask_ + 1;
  while ((range.first + room) / kSize - oldest() / kSize >= capacity) capacity *= 2;
  auto rest = copy(capacity, range.first - range.first % kSize);
  for (std::uint64_t number = rest->next_; number < next_; ++number) {
    if (is_last_of_chunk(number)) store.supersede(chunk(number));
  }
  for (std::uint64_t number = rest->next_; number < range.first; ++number) {
    rest->append(*at(number), store);
  }
  for (std::uint64_t number = range.first; number < range.end; ++number) {
    store.release(at(number)->shared);
  }
  return rest;
}

void SampleHistory::continue_from(const SampleHistory& before, const Range& replaced,
                                  std::uint64_t history, std::int64_t kept_before) {
  left_behind = false;
  const std::uint64_t made_up = before.made_up_end();
  if (made_up > replaced.end) {
    made_up_end_.store(made_up + next_ - before.next_, std::memory_order_relaxed);
  } else if (made_up > replaced.first) {
    // Which one before it was made up, is not known.
    made_up_end_.store(replaced.first, std::memory_order_relaxed);
  }
  for (Earlier& one : earlier_) one.kept_before = std::min(one.kept_before, kept_before);
  std::rotate(earlier_.begin(), earlier_.end() - 1, earlier_.end());
  earlier_.front() = {history, kept_before};
}

std::int64_t SampleHistory::kept_before(std::uint64_t history) const {
  const auto found = std::find_if(earlier_.begin(), earlier_.end(),
                                  [history](const Earlier& one) { return one.history == history; });
  return history != 0 && found != earlier_.end() ? found->kept_before : kAlways;
}

SampleHistory::Pointer SampleHistory::replaced(const std::vector<Sample>& samples,
                                               std::uint64_t place, SampleStore& store) const {
  auto with_others = copy(mask_ + 1, next_);
  for (std::size_t i = 0; i < samples.size(); ++i, ++place) {
    if (i == 0 || place % kSize == 0) {
      SampleChunk* fresh = store.take_chunk();
      *fresh = *chunk(place);
      store.supersede(chunk(place));
      with_others->put(fresh);
    }
    with_others->rewrite(samples[i], place);
  }
  return with_others;
}

}  // namespace tfdude
