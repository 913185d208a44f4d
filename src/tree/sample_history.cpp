#include "tree/sample_history.hpp"

#include <algorithm>

namespace tfdude {

// A slot is rewritten only after its sample was dropped. So, if the first sample is still kept,
// everything read before is valid.
SampleHistory::Bracket SampleHistory::pair(std::uint64_t before) const {
  const Bracket found{slot(before).sample.load(std::memory_order_acquire),
                      slot(before + 1).sample.load(std::memory_order_acquire)};
  return oldest() <= before ? found : Bracket{};
}

SampleHistory::Bracket SampleHistory::around(std::int64_t t, std::uint64_t newest,
                                             std::uint64_t& back) const {
  // How far a guess may be off before bisection is faster.
  constexpr int kSteps = 4;
  std::uint64_t low = oldest();
  std::uint64_t high = newest;
  if (back > 0 && back <= high - low) {
    const std::uint64_t same = high - back;
    if (stamp_at(same) <= t && t < stamp_at(same + 1)) return pair(same);
  }
  const std::int64_t first = stamp_at(low);
  const std::int64_t last = stamp_at(high);
  if (low >= high || t < first) return {};
  const double share = static_cast<double>(t - first) / static_cast<double>(last - first);
  std::uint64_t at = low + static_cast<std::uint64_t>(share * static_cast<double>(high - low));
  for (int step = 0; high - low > 1; ++step) {
    if (step >= kSteps) at = low + (high - low) / 2;
    at = std::clamp(at, low + 1, high - 1);
    if (stamp_at(at) <= t) {
      low = at++;
    } else {
      high = at--;
    }
  }
  back = newest - low;
  return pair(low);
}

HeldVersion* SampleHistory::sample(std::uint64_t number) const {
  HeldVersion* found = slot(number).sample.load(std::memory_order_acquire);
  return oldest() <= number ? found : nullptr;
}

std::int64_t SampleHistory::stamp(std::uint64_t number) const {
  const std::int64_t found = stamp_at(number);
  return oldest() <= number ? found : kAlways;
}

std::uint64_t SampleHistory::place_of(std::int64_t stamp) const {
  std::uint64_t place = next_;
  while (place > first_.load(std::memory_order_relaxed) && stamp_at(place - 1) >= stamp) --place;
  return place;
}

void SampleHistory::append(HeldVersion* sample, std::int64_t stamp) {
  Slot& free = slot(next_++);
  free.stamp.store(stamp, std::memory_order_release);
  free.sample.store(sample, std::memory_order_release);
}

HeldVersion* SampleHistory::drop_oldest() {
  const std::uint64_t first = first_.load(std::memory_order_relaxed);
  HeldVersion* dropped = slot(first).sample.load(std::memory_order_relaxed);
  first_.store(first + 1, std::memory_order_release);
  return dropped;
}

std::unique_ptr<SampleHistory> SampleHistory::empty_copy(std::uint64_t capacity) const {
  std::unique_ptr<SampleHistory> copy(new SampleHistory(timing_, capacity));
  copy->rewritten = rewritten;
  return copy;
}

std::unique_ptr<SampleHistory> SampleHistory::grown() const {
  auto copy = empty_copy(2 * (mask_ + 1));
  for (std::uint64_t number = oldest(); number < next_; ++number) {
    copy->append(slot(number).sample.load(std::memory_order_relaxed), stamp_at(number));
  }
  return copy;
}

std::unique_ptr<SampleHistory> SampleHistory::with(HeldVersion* sample, std::int64_t stamp,
                                                   std::uint64_t place) const {
  auto copy = empty_copy(full() ? 2 * (mask_ + 1) : mask_ + 1);
  for (std::uint64_t number = oldest(); number < next_; ++number) {
    if (number == place) copy->append(sample, stamp);
    copy->append(slot(number).sample.load(std::memory_order_relaxed), stamp_at(number));
  }
  return copy;
}

std::unique_ptr<SampleHistory> SampleHistory::replaced(HeldVersion* sample,
                                                       std::uint64_t place) const {
  auto copy = empty_copy(mask_ + 1);
  for (std::uint64_t number = oldest(); number < next_; ++number) {
    HeldVersion* own = slot(number).sample.load(std::memory_order_relaxed);
    copy->append(number == place ? sample : own, stamp_at(number));
  }
  return copy;
}

}  // namespace tfdude
