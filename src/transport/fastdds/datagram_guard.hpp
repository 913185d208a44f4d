#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "transport/fastdds/crowd.hpp"
#include "transport/fastdds/departures.hpp"
#include "transport/fastdds/number_bounds.hpp"
#include "transport/fastdds/reassembly.hpp"
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
  explicit DatagramGuard(bool secured) : secured_(secured), crowd_(secured) {}

  /// All that the participant sends passes send(). Call it before the participant is created.
  void sees_all_sent() { sees_sent_ = !secured_; }

  /// Fragments are passed on as they come: a peer of another vendor may repeat only the first one
  /// of a sample, and wait until the others are asked for. Call it before the participant is
  /// created.
  void passes_fragments() { passes_fragments_ = true; }

  struct Bytes {
    const std::uint8_t* data;
    std::size_t size;
  };

  /// Calls deliver(datagrams, many) for what Fast DDS may have, all of it or nothing: this
  /// datagram, or, if it has fragments, all of a sample that they complete, and then what else is
  /// in it.
  /// @param from  names the sender, for the log
  template <class Name, class Deliver>
  void receive(const std::uint8_t* datagram, std::size_t size, Clock::time_point now,
               const Name& from, const Deliver& deliver) {
    bool fragments = false;
    const DatagramFlaw flaw = check(datagram, size, now, fragments);
    if (flaw == DatagramFlaw::kFarewell) return;
    if (flaw != DatagramFlaw::kNone) {
      if (count(flaw, now)) log(flaw, from());
    } else if (!fragments || passes_fragments_) {
      const Bytes only{datagram, size};
      deliver(&only, std::size_t{1});
    } else {
      for (const auto& whole : reassemble(datagram, size, now)) {
        std::vector<Bytes> all;
        for (const auto& one : whole) all.push_back({one.data(), one.size()});
        deliver(all.data(), all.size());
      }
    }
  }

  void send(const std::uint8_t* datagram, std::size_t size);

  /// Fast DDS has verified its identity.
  void verified(const PeerId& peer) { crowd_.verified(peer); }
  /// Fast DDS has removed it. A datagram that says so does not suffice, as Fast DDS may ignore it.
  void left(const PeerId& peer) { crowd_.left(peer); }

  /// Calls leave(peer) for each participant that Fast DDS shall take for gone: those that have made
  /// room for others, and those that have said, unprotected, that they leave, and are silent since.
  /// Of the latter there are none without keys: Fast DDS has such a datagram at once.
  template <class Leave>
  void take_departed(Clock::time_point now, const Leave& leave) {
    crowd_.take(leave);
    departures_.take(now, leave);
  }

  /// How many were dropped.
  [[nodiscard]] std::uint64_t refused() const;

 private:
  struct Kind {
    std::atomic<std::uint64_t> count{0};
    std::atomic<Clock::rep> logged{0};  // 0: never
  };

  [[nodiscard]] DatagramFlaw check(const std::uint8_t* datagram, std::size_t size,
                                   Clock::time_point now, bool& fragments);
  [[nodiscard]] std::vector<std::vector<Reassembly::Datagram>> reassemble(
      const std::uint8_t* datagram, std::size_t size, Clock::time_point now);
  bool count(DatagramFlaw flaw, Clock::time_point now);  // returns whether to log it
  void log(DatagramFlaw flaw, const std::string& from) const;

  const bool secured_;
  bool sees_sent_ = false;
  bool passes_fragments_ = false;
  NumberBounds bounds_;
  Crowd crowd_;
  Departures departures_;
  Reassembly fragments_;
  std::array<Kind, static_cast<std::size_t>(DatagramFlaw::kFlawCount)> kinds_;
};

}  // namespace tfdude::fastdds
