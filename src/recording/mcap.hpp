#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

// The records of MCAP (https://mcap.dev/spec), as far as recordings of transforms need them.
namespace tfdude::recording {

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};

enum class Op : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

/// Bytes of a record before its body: its kind, and the length of the body.
inline constexpr std::uint64_t kRecordHead = 9;
/// Bytes of a footer with its head, and of the magic after it.
inline constexpr std::uint64_t kFooterRecord = kRecordHead + 20;

struct Schema {
  std::uint16_t id = 0;
  std::string name;
  std::string encoding;
  std::string data;
};

struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema = 0;  ///< 0: none
  std::string topic;
  std::string encoding;
  std::map<std::string, std::string> metadata;
};

struct Message {
  std::uint16_t channel = 0;
  std::int64_t log_time = 0;      ///< [ns]
  std::int64_t publish_time = 0;  ///< [ns]
  std::string_view data;
};

struct Metadata {
  std::string name;
  std::map<std::string, std::string> values;
};

}  // namespace tfdude::recording
