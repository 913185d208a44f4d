#pragma once

#include <cstdint>

namespace tfdude {

/// The first and last DDS domain in which keys are valid.
struct DomainRange {
  std::uint32_t first = 0;
  std::uint32_t last = 232;

  friend bool operator==(const DomainRange& a, const DomainRange& b) {
    return a.first == b.first && a.last == b.last;
  }
};

/// What all identities of an authority have in common.
struct KeySettings {
  bool encrypt = true;  ///< false: messages are signed, and can be read by anybody
  DomainRange domains;

  friend bool operator==(const KeySettings& a, const KeySettings& b) {
    return a.encrypt == b.encrypt && a.domains == b.domains;
  }
};

}  // namespace tfdude
