#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <ctime>
#include <sys/syscall.h>
#include <unistd.h>

#include <linux/futex.h>

#include "memory/waiting.hpp"

namespace tfdude {
namespace {

// Headers older than Linux 5.16 do not know it; its number is the same on all architectures.
constexpr long kFutexWaitv = 449;
constexpr std::uint32_t kOf32Bits = 2;

struct Waited {
  std::uint64_t value;
  std::uint64_t address;
  std::uint32_t flags;
  std::uint32_t reserved;
};

const std::uint32_t* lower_half(const std::atomic<std::uint64_t>& number) {
  // NOLINTNEXTLINE(*-reinterpret-cast): as the kernel compares it
  const auto* halves = reinterpret_cast<const std::uint32_t*>(&number);
  return halves + (__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__ ? 0 : 1);
}

long wait_for_any(const Waited* all, std::size_t count, const timespec& until) {
  return syscall(kFutexWaitv, all, static_cast<unsigned>(count), 0U, &until, CLOCK_MONOTONIC);
}

Waited waited(const WaitedNumber& one) {
  // NOLINTNEXTLINE(*-reinterpret-cast): as the kernel wants it
  const auto address = reinterpret_cast<std::uint64_t>(lower_half(*one.number));
  return {static_cast<std::uint32_t>(one.seen), address, kOf32Bits, 0};
}

}  // namespace

bool can_wait_for_numbers() {
  static const bool can = [] {
    const std::atomic<std::uint64_t> number{0};
    const Waited other = waited({&number, 1});
    return wait_for_any(&other, 1, {}) < 0 && errno == EAGAIN;
  }();
  return can;
}

void wait_for_numbers(const std::vector<WaitedNumber>& numbers,
                      std::chrono::steady_clock::time_point until) {
  std::array<Waited, kMostWaitedNumbers> all{};
  const std::size_t count = std::min(numbers.size(), all.size());
  std::transform(numbers.begin(), numbers.begin() + static_cast<std::ptrdiff_t>(count), all.begin(),
                 waited);
  const auto since_start =
      std::chrono::duration_cast<std::chrono::nanoseconds>(until.time_since_epoch()).count();
  constexpr std::int64_t kSecond = 1'000'000'000;
  const timespec time{static_cast<std::time_t>(since_start / kSecond),
                      static_cast<long>(since_start % kSecond)};
  (void)wait_for_any(all.data(), count, time);
}

void wake_waiting(const std::atomic<std::uint64_t>& number) {
  (void)syscall(SYS_futex, lower_half(number), FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
}

}  // namespace tfdude
