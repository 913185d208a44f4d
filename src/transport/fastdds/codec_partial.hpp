#pragma once

#include <cstdint>
#include <string_view>

#include "transport/fastdds/codec_values.hpp"
#include "transport/fastdds/topics.hpp"
#include "tree/forest.hpp"

// Parts of values, for updates and moves that give only these.
namespace tfdude::fastdds {

/// @return which parts are given, as bits
[[nodiscard]] std::uint8_t write_parts(const PartialTransform& parts, Numbers& out);
/// @return kInvalidInput naming the frame and the invalid part
[[nodiscard]] Result<PartialTransform> read_parts(std::uint8_t given, const Numbers& in,
                                                  std::string_view frame);

[[nodiscard]] wire::PartialEdge wire_partial(const PartialUpdate& edge);

/// @return kInvalidInput naming the frame and the invalid part
[[nodiscard]] Result<PartialUpdate> read_partial(const wire::PartialEdge& in);

}  // namespace tfdude::fastdds
