#pragma once

#include <cstddef>
#include <cstdint>

namespace tfdude {

/// Writes a number as sizeof(Number) bytes, the least one first.
template <class Number>
void put_number(char* to, Number value) {
  for (std::size_t i = 0; i < sizeof value; ++i) {
    to[i] = static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i));
  }
}

}  // namespace tfdude
