#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "tfdude/base/time.hpp"
#include "tfdude/types/version.hpp"

namespace tfdude {

/// Information about one partition.
struct PartitionInfo {
  std::string name;
  std::string host;  ///< empty: it was lost before this process could discover it
  std::uint32_t pid = 0;
  std::size_t frames = 0;
  bool reachable = false;
  Time since{};          ///< when `reachable` last changed, by the caller's clock
  bool stopped = false;  ///< if not reachable: it announced its stop; otherwise it was lost
  /// If not reachable: others have only said that it is silent. They say within a second whether it
  /// was stopped or is lost.
  bool silent = false;
  std::string program{};  ///< the version of its program; empty: not known
  ProtocolVersion protocol = kProtocolVersion;
  std::optional<ClockKind> clock{};  ///< that its stamps are of; absent: not known (yet)
  bool in_memory =
      false;  ///< lookups read its frames in its memory; otherwise they ask it over DDS
  std::string why_not_in_memory{};  ///< a sentence without its end; empty: they do, or it is own
  /// All frames that it has announced have come here. If it is not reachable, it was lost after
  /// that.
  bool complete = true;

  /// Whether its protocol is understood here. If not, only its name and versions are known.
  [[nodiscard]] bool compatible() const { return protocol.major == kProtocolVersion.major; }
};

/// "was stopped", "is lost" or "does not respond", for a partition that is not reachable.
[[nodiscard]] inline const char* why_absent(const PartitionInfo& partition) {
  if (partition.silent) return "does not respond";
  return partition.stopped ? "was stopped" : "is lost";
}

}  // namespace tfdude
