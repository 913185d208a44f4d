#pragma once

#include <cstddef>
#include <cstdint>

namespace tfdude::fastdds::rtps {

/// Bytes of a datagram: "RTPS", version, vendor, and from kPrefixAt the prefix of the sender's
/// GUIDs (RTPS 2.2, section 9.4.4). Then submessages, each with a header: id, flags, length.
constexpr std::size_t kPrefixAt = 8;
constexpr std::size_t kHeader = 20;
constexpr std::size_t kSubmessageHeader = 4;

/// RTPS 2.2, section 9.4.5.1.1, and DDS Security 1.1, section 7.3.6.
enum Id : std::uint8_t {
  kPad = 0x01,
  kAckNack = 0x06,
  kHeartbeat = 0x07,
  kGap = 0x08,
  kInfoTimestamp = 0x09,
  kInfoSource = 0x0C,
  kInfoDestination = 0x0E,
  kNackFragments = 0x12,
  kHeartbeatFragment = 0x13,
  kData = 0x15,
  kDataFragment = 0x16,
  kSecureBody = 0x30,
  kSecurePrefix = 0x31,
  kSecurePostfix = 0x32,
  kMessagePrefix = 0x33,
};

/// A flag of all submessages, and one of DATA.
constexpr std::uint8_t kLittleEndian = 0x01;
constexpr std::uint8_t kDataFlag = 0x04;

}  // namespace tfdude::fastdds::rtps
