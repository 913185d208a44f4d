#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>

#include "transport/fastdds/number_bounds.hpp"
#include "transport/fastdds/rtps_check.hpp"

namespace tfdude::fastdds {

/// Decides which datagrams Fast DDS may have. Logs the first one of each kind that it drops, and
/// then once per kLogEvery how many there were.
/// @par Thread safety  All functions are thread-safe.
class DatagramGuard {
 public:
  using Clock = NumberBounds::Clock;

  static constexpr std::chrono::seconds kLogEvery{60};

  /// @param secured  the participant has keys, with which all messages are protected as a whole
  explicit DatagramGuard(bool secured) : secured_(secured) {}

  /// All that the participant sends passes send(). Call it before the participant is created.
  void sees_all_sent() { sees_sent_ = !secured_; }

  /// @param from  names the sender, for the log
  template <class Name>
  [[nodiscard]] bool admit(const std::uint8_t* datagram, std::size_t size, Clock::time_point now,
                           const Name& from) {
    const DatagramFlaw flaw = check(datagram, size, now);
    if (flaw == DatagramFlaw::kNone) return true;
    if (count(flaw, now)) log(flaw, from());
    return false;
  }

  void send(const std::uint8_t* datagram, std::size_t size);

  /// How many were dropped.
  [[nodiscard]] std::uint64_t refused() const;

 private:
  struct Kind {
    std::atomic<std::uint64_t> count{0};
    std::atomic<Clock::rep> logged{0};  // 0: never
  };

  [[nodiscard]] DatagramFlaw check(const std::uint8_t* datagram, std::size_t size,
                                   Clock::time_point now);
  bool count(DatagramFlaw flaw, Clock::time_point now);  // returns whether to log it
  void log(DatagramFlaw flaw, const std::string& from) const;

  const bool secured_;
  bool sees_sent_ = false;
  NumberBounds bounds_;
  std::array<Kind, static_cast<std::size_t>(DatagramFlaw::kFlawCount)> kinds_;
};

}  // namespace tfdude::fastdds
