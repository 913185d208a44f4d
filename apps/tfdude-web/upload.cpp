#include "upload.hpp"

#include <algorithm>
#include <string>

namespace tfdude::web {
namespace {

std::string mebibytes(std::uint64_t bytes) {
  constexpr std::uint64_t kMiB = std::uint64_t{1} << 20U;
  return std::to_string(bytes / kMiB + (bytes % kMiB == 0 ? 0 : 1)) + " MiB";
}

}  // namespace

bool Upload::receive(std::size_t size, Clock::time_point now) {
  const auto next = static_cast<std::size_t>(std::min<std::uint64_t>(kPiece, bytes_ - received_));
  if (next == 0 || size != next || received_ - written_ > (kAhead - 1) * kPiece) return false;
  received_ += size;
  last_ = now;
  return true;
}

Result<void> check_size(std::uint64_t bytes, std::uint64_t most) {
  if (most == 0) return fail(Errc::kTooMuch, "this server takes no recordings (--max-recording 0)");
  if (bytes == 0) return fail(Errc::kInvalidInput, "the file is empty");
  if (bytes <= most) return {};
  return fail(Errc::kTooMuch, "the file has " + mebibytes(bytes) + ", and this server takes " +
                                  mebibytes(most) + " (--max-recording)");
}

Result<void> check_beginning(std::string_view piece) {
  constexpr std::string_view kMagic = "\x89MCAP0\r\n";
  if (piece.substr(0, kMagic.size()) == kMagic) return {};
  return fail(Errc::kConfig,
              "the file is no MCAP file: record one with `tfdude record`, or with "
              "`ros2 bag record --storage mcap`");
}

}  // namespace tfdude::web
