#include "tree/sample_history.hpp"

#include <algorithm>

namespace tfdude {
namespace {

constexpr std::uint64_t kSize = SampleChunk::kSize;

}  // namespace

SampleHistory::SampleHistory(const EdgeTiming& timing, std::uint64_t capacity)
    : timing_(timing),
      has_noise_(timing.process_noise.upper() != Covariance::Upper{}),
      mask_(capacity - 1),
      chunks_(new std::atomic<SampleChunk*>[capacity]()) {}

// A sample that is dropped meanwhile stays as it is until this reader has left. But another one may
// take its place: it then counts as earlier than t.
SampleHistory::Bracket SampleHistory::around(std::int64_t t, std::uint64_t newest,
                                             std::uint64_t& back) const {
  // How far a guess may be off before bisection is faster.
  constexpr int kSteps = 4;
  std::uint64_t low = oldest();
  std::uint64_t high = newest;
  if (back > 0 && back <= high - low) {
    const Sample* before = sample(high - back);
    const Sample* after = sample(high - back + 1);
    const bool both = before != nullptr && after != nullptr;
    if (both && before->stamp <= t && t < after->stamp) return {before, after};
  }
  const Sample* before = sample(low);
  const Sample* after = sample(high);
  if (low >= high || after == nullptr || (before != nullptr && t < before->stamp)) return {};
  std::uint64_t at = low;
  if (before != nullptr) {
    const double share =
        static_cast<double>(t - before->stamp) / static_cast<double>(after->stamp - before->stamp);
    at += static_cast<std::uint64_t>(share * static_cast<double>(high - low));
  }
  for (int step = 0; high - low > 1; ++step) {
    if (step >= kSteps) at = low + (high - low) / 2;
    at = std::clamp(at, low + 1, high - 1);
    const Sample* here = sample(at);
    if (here == nullptr || here->stamp <= t) {
      before = here;
      low = at++;
    } else {
      after = here;
      high = at--;
    }
  }
  back = newest - low;
  return before != nullptr ? Bracket{before, after} : Bracket{};
}

std::int64_t SampleHistory::reach(std::uint64_t newest) const {
  // An error of a sample is twice as many times as large there.
  constexpr std::int64_t kMostIntervals = 100;
  if (newest <= oldest() || made_up_end_.load(std::memory_order_relaxed) >= newest) return 0;
  const Sample* before = sample(newest - 1);
  const Sample* after = sample(newest);
  if (before == nullptr || after == nullptr) return 0;
  const std::int64_t interval = after->stamp - before->stamp;
  return interval > INT64_MAX / kMostIntervals ? INT64_MAX : kMostIntervals * interval;
}

bool SampleHistory::is_timed_since(std::int64_t t, std::uint64_t newest) const {
  const std::uint64_t end = made_up_end_.load(std::memory_order_relaxed);
  if (end <= oldest()) return true;
  return end <= newest && stamp(end) <= t;
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

std::unique_ptr<SampleHistory> SampleHistory::copy(std::uint64_t capacity,
                                                   std::uint64_t end) const {
  std::unique_ptr<SampleHistory> copy(new SampleHistory(timing_, capacity));
  const std::uint64_t first = oldest();
  copy->rewritten = rewritten;
  copy->left_behind = left_behind;
  copy->made_up_end_.store(made_up_end_.load(std::memory_order_relaxed), std::memory_order_relaxed);
  copy->first_.store(first, std::memory_order_relaxed);
  copy->next_ = std::max(first, end);
  for (std::uint64_t number = first; number < end; number += kSize - number % kSize) {
    copy->put(chunk(number));
  }
  copy->find_ends();
  return copy;
}

std::unique_ptr<SampleHistory> SampleHistory::grown() const { return copy(2 * (mask_ + 1), next_); }

std::unique_ptr<SampleHistory> SampleHistory::with(const Sample& sample, std::uint64_t place,
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

std::unique_ptr<SampleHistory> SampleHistory::replaced(const Sample& sample, std::uint64_t place,
                                                       SampleStore& store) const {
  auto with_other = copy(mask_ + 1, next_);
  SampleChunk* fresh = store.take_chunk();
  *fresh = *chunk(place);
  store.supersede(chunk(place));
  with_other->put(fresh);
  with_other->rewrite(sample, place);
  return with_other;
}

}  // namespace tfdude
