#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "tfdude/base/result.hpp"

// A file that a page sends, without a disk.
namespace tfdude::web {

/// Keeps count of a file that comes in pieces: which size the next one must have, how many may be
/// ahead of the disk, and how long all may take.
class Upload {
 public:
  using Clock = std::chrono::steady_clock;

  /// All pieces but the last one have this size [B].
  static constexpr std::size_t kPiece = std::size_t{64} << 10U;
  /// So many may have come that are not written yet.
  static constexpr std::size_t kAhead = 8;
  static constexpr std::chrono::seconds kPieceTime{10};
  static constexpr std::chrono::minutes kWholeTime{10};

  Upload(std::uint64_t bytes, Clock::time_point now)
      : bytes_(bytes), last_(now), end_(now + kWholeTime) {}

  /// Counts a piece. @return whether it may come now, and has the right size
  [[nodiscard]] bool receive(std::size_t size, Clock::time_point now);
  /// Counts a piece that is on the disk.
  void write(std::size_t size) { written_ += size; }

  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  [[nodiscard]] std::uint64_t received() const { return received_; }
  [[nodiscard]] std::uint64_t written() const { return written_; }
  [[nodiscard]] bool complete() const { return written_ == bytes_; }
  /// Whether it has stalled, or takes too long.
  [[nodiscard]] bool is_late(Clock::time_point now) const {
    return received_ < bytes_ && (now - last_ > kPieceTime || now > end_);
  }

 private:
  std::uint64_t bytes_;
  std::uint64_t received_ = 0;
  std::uint64_t written_ = 0;
  Clock::time_point last_;
  Clock::time_point end_;
};

/// Whether a file may be sent. @param most  as Settings::most_recording_bytes
/// @return kTooMuch, kInvalidInput (it is empty)
[[nodiscard]] Result<void> check_size(std::uint64_t bytes, std::uint64_t most);

/// Whether a file that begins so may be one of MCAP, so that others are rejected before they are
/// sent. @return kConfig
[[nodiscard]] Result<void> check_beginning(std::string_view piece);

}  // namespace tfdude::web
