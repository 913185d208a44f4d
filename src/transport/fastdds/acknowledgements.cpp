#include "transport/fastdds/acknowledgements.hpp"

#include <algorithm>
#include <cstring>

#include "transport/fastdds/rtps_layout.hpp"

namespace tfdude::fastdds {
namespace {

// In ACKNACK with its header (RTPS 2.2, section 9.4.5.2): the writer, and the first sample that is
// missing.
constexpr std::size_t kWriterAt = 8;
constexpr std::size_t kMissingAt = 12;
constexpr std::size_t kAckNackLeast = 20;

std::uint32_t number_at(const std::uint8_t* bytes, std::size_t size, bool little) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < size; ++i) number = number << 8U | bytes[little ? size - 1 - i : i];
  return number;
}

// Calls take(submessage) for each ACKNACK.
template <class Take>
void for_each_acknack(const std::uint8_t* datagram, std::size_t size, Take take) {
  for (std::size_t at = rtps::kHeader; at + rtps::kSubmessageHeader <= size;) {
    const std::uint8_t* submessage = datagram + at;
    const bool little = (submessage[1] & rtps::kLittleEndian) != 0;
    const std::size_t length = number_at(submessage + 2, 2, little);
    if (submessage[0] == rtps::kAckNack && length + rtps::kSubmessageHeader >= kAckNackLeast &&
        at + kAckNackLeast <= size) {
      take(submessage, little);
    }
    if (length == 0) return;  // the last one, or without content
    at += rtps::kSubmessageHeader + length;
  }
}

}  // namespace

void Acknowledgements::heard(const std::uint8_t* datagram, std::size_t size) {
  if (waiting_.load(std::memory_order_relaxed) == 0) return;
  if (size < rtps::kHeader || std::memcmp(datagram, "RTPS", 4) != 0) return;
  Key key;
  std::copy_n(datagram + rtps::kPrefixAt, key.first.size(), key.first.begin());
  for_each_acknack(datagram, size, [&](const std::uint8_t* submessage, bool little) {
    std::copy_n(submessage + kWriterAt, key.second.size(), key.second.begin());
    const std::uint64_t high = number_at(submessage + kMissingAt, 4, little);
    const std::uint64_t missing = high << 32U | number_at(submessage + kMissingAt + 4, 4, little);
    {
      const Lock lock(mutex_);
      const auto known = missing_.find(key);
      if (known == missing_.end()) return;
      known->second = std::max(known->second, missing);
    }
    changed_.notify_all();
  });
}

bool Acknowledgements::wait_until(const PeerId& reader, const WriterId& writer,
                                  std::uint64_t number, Deadline deadline) {
  Lock lock(mutex_);
  // Strangers may send any number of others.
  const auto known = missing_.try_emplace({reader, writer}, 0).first;
  ++waiting_;
  const bool acknowledged =
      changed_.wait_until(lock, deadline, [&] { return known->second > number; });
  if (--waiting_ == 0) missing_.clear();
  return acknowledged;
}

}  // namespace tfdude::fastdds
