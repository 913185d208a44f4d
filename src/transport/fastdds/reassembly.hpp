#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <tuple>
#include <vector>

#include "base/mutex.hpp"
#include "transport/fastdds/rtps_check.hpp"

namespace tfdude::fastdds {

/// Keeps fragments of samples until all of a sample have come, so that Fast DDS never has one in
/// part. It (2.9 and 3.1) allocates the whole sample at its first fragment, and keeps it as long as
/// the writer lives; and if the same number then comes as DATA, it ends the process
/// (DataReaderHistory::update_instance_nts). Both cost a stranger one datagram.
///
/// - What is kept are the bytes that came: at most kMostBytes, of kMost samples, and kOfWriter of
///   one writer. The one that has not grown for longest makes room.
/// - Fragments that say other sizes are of another sample, even if that has the same number. The
///   one that is first complete counts.
/// - A sample that does not grow for kPatience is dropped. A reliable writer then sends it again.
/// @par Thread safety  All functions are thread-safe.
class Reassembly {
 public:
  using Clock = std::chrono::steady_clock;
  using Datagram = std::vector<std::uint8_t>;

  static constexpr std::size_t kMostBytes = std::size_t{64} << 20U;
  static constexpr std::size_t kMost = 1024;
  static constexpr std::size_t kOfWriter = 8;
  static constexpr std::chrono::seconds kPatience{60};
  /// Of so many complete samples the sizes are known.
  static constexpr std::size_t kKnown = 256;

  /// @param claim  of fragments
  /// @param datagram  that contains them, and nothing else of a writer
  /// @return all datagrams of the sample, in order, if it is complete; otherwise none
  /// @par Complexity  O(size of the datagram + kMost)
  [[nodiscard]] std::vector<Datagram> take(const NumberClaim& claim, Datagram datagram,
                                           Clock::time_point now);

  /// How many bytes are kept.
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Key {
    NumberClaim::Prefix sender;
    NumberClaim::Entity writer;
    std::uint64_t number = 0;
    std::uint32_t sample = 0;
    std::uint16_t each = 0;
    [[nodiscard]] auto tie() const { return std::tie(sender, writer, number, sample, each); }
    [[nodiscard]] bool operator<(const Key& other) const { return tie() < other.tie(); }
  };
  struct Part {
    std::map<std::uint32_t, Datagram> datagrams;  // by their first fragment
    std::vector<bool> has;                        // each fragment
    std::size_t missing = 0;
    std::size_t bytes = 0;
    std::uint64_t grown = 0;  // a count
    Clock::time_point at{};
  };
  using Parts = std::map<Key, Part>;

  [[nodiscard]] bool conflicts(const Key& key) const TFDUDE_REQUIRES(mutex_);
  Part& part_of(const Key& key) TFDUDE_REQUIRES(mutex_);
  void make_room(const Key& but, Clock::time_point now) TFDUDE_REQUIRES(mutex_);
  void drop(Parts::iterator part) TFDUDE_REQUIRES(mutex_);

  mutable Mutex mutex_;
  Parts parts_ TFDUDE_GUARDED_BY(mutex_);
  std::vector<Key> complete_ TFDUDE_GUARDED_BY(mutex_);  // a ring
  std::size_t next_ TFDUDE_GUARDED_BY(mutex_) = 0;       // in it
  std::size_t bytes_ TFDUDE_GUARDED_BY(mutex_) = 0;
  std::uint64_t count_ TFDUDE_GUARDED_BY(mutex_) = 0;
};

}  // namespace tfdude::fastdds
