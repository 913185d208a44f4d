#pragma once

#include <string>
#include <vector>

#include "tfdude/client/client.hpp"

namespace tfdude::cli {

/// Adds frames to a partition, or updates those that it has: values, parents, correlations. The
/// parents come before their children. Until the new values are there, an edge has its value of
/// before or an unspecified covariance, so at no moment does it claim more than before and after.
/// The values of at most 4096 edges become visible in one commit.
/// @return kAlreadyExists (a frame of another partition), kCycle, kInvalidInput (the error sources
///   of an edge would change while it has samples, or while coupled joints move it): before
///   anything is changed. After other errors, as of the Client, new frames are removed again, or
///   the message names the frames that stay without a covariance.
[[nodiscard]] Result<void> import_frames(Client& client, const std::string& partition,
                                         const std::vector<FrameSpec>& frames);

}  // namespace tfdude::cli
