#pragma once

#include "../settings.hpp"
#include "mapping.hpp"

// The sections of a configuration that have a list of topics.
namespace tfdude::ros {

[[nodiscard]] Result<void> values_in(const Section& section, Settings& settings);
[[nodiscard]] Result<void> detections_in(const Section& section, Settings& settings);
[[nodiscard]] Result<void> poses_in(const Section& section, Settings& settings);
[[nodiscard]] Result<void> poses_out(const Section& section, Settings& settings);

}  // namespace tfdude::ros
