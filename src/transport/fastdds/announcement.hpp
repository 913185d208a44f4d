#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tfdude/types/version.hpp"

namespace tfdude::fastdds {

/// What a participant says of itself in DDS's discovery, before any message of ours is decoded: by
/// the name of its DDS participant whether it serves a partition, and which; by its user data which
/// version it speaks, and whose keys it has.
struct Announcement {
  bool is_ours = false;   ///< a participant of tf-dude
  std::string partition;  ///< empty: it serves none
  ProtocolVersion protocol = kProtocolVersion;
  std::string program;    ///< the version of its program
  std::string authority;  ///< that signed its keys; empty: it has none

  /// Whether messages can be exchanged with it.
  [[nodiscard]] bool compatible() const { return protocol.major == kProtocolVersion.major; }
};

/// The DDS participant's name.
[[nodiscard]] std::string participant_name(const std::string& partition);

/// The DDS participant's user data. @param authority  of its keys; empty: none
[[nodiscard]] std::vector<std::uint8_t> user_data(const std::string& authority);

/// A participant of tf-dude without a version is of 0.0, from before there were any. Any other
/// participant of DDS counts as compatible: it may write streams.
[[nodiscard]] Announcement read_announcement(const std::string& name,
                                             const std::vector<std::uint8_t>& data);

}  // namespace tfdude::fastdds
