#pragma once

#include <vector>

#include "tfdude/base/result.hpp"

#include "partition/messages.hpp"
#include "transport/fastdds/compat.hpp"

// Converts requests for frames, and the answers, for the network and from it.
namespace tfdude::fastdds {

[[nodiscard]] wire::FramesBody write_frames(const FramesRequest& asked);
[[nodiscard]] std::vector<wire::KnownFrame> write_frames(const std::vector<KnownFrame>& known);

/// @return kInvalidInput, naming the field
[[nodiscard]] Result<FramesRequest> read_frames(const wire::FramesBody& body);
[[nodiscard]] Result<std::vector<KnownFrame>> read_frames(
    const std::vector<wire::KnownFrame>& body);

}  // namespace tfdude::fastdds
