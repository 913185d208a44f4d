#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "fuzz/demand.hpp"
#include "support/samples.hpp"

namespace tfdude::fuzz {

using Key = std::array<std::uint8_t, 16>;

/// The key of the DDS instance to which a sample belongs.
template <class Type, class Sample>
[[nodiscard]] Key key_of(Sample& sample) {
  Type type;
  fastdds::ertps::InstanceHandle_t handle;
#if TFDUDE_FASTDDS_MAJOR == 2
  demand(type.getKey(&sample, &handle, false), "every sample has a key");
#else
  demand(type.compute_key(&sample, handle, false), "every sample has a key");
#endif
  Key key{};
  for (std::size_t i = 0; i < key.size(); ++i) key[i] = handle.value[i];
  return key;
}

}  // namespace tfdude::fuzz
