#pragma once

#include <cstdint>
#include <string>

#include "tfdude/base/export.hpp"

namespace tfdude {

/// The version of what participants send to each other. Those of one major version understand each
/// other; docs/transport.md says what a minor version may add.
struct ProtocolVersion {
  std::uint16_t major = 0;
  std::uint16_t minor = 0;

  friend bool operator==(ProtocolVersion a, ProtocolVersion b) {
    return a.major == b.major && a.minor == b.minor;
  }
};

/// The version that this library speaks.
inline constexpr ProtocolVersion kProtocolVersion{1, 1};

/// As in "1.0".
[[nodiscard]] TFDUDE_EXPORT std::string to_string(ProtocolVersion version);

/// The version of this library, as in "0.1.0".
[[nodiscard]] TFDUDE_EXPORT std::string program_version();

/// All versions in one line, for bug reports: program, protocol, Fast DDS, kind of build.
[[nodiscard]] TFDUDE_EXPORT std::string version_line();

}  // namespace tfdude
