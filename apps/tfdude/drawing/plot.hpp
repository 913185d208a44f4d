#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tfdude/types/query.hpp"

#include "../../rendering/angles.hpp"
#include "plot_geometry.hpp"

// Draws where a frame is, with its uncertainty: from its data to SVG.
namespace tfdude::cli {

struct Plot {
  StampedTransform X_AB;
  std::vector<std::string> frames;   ///< of the path, from A to B
  std::vector<Step> steps;           ///< between them
  std::vector<std::string> assumed;  ///< joints of the path that have had no sample
  int samples = 0;                   ///< number of points to sample and draw
  AngleUnit angles = kRadian;
};

inline constexpr std::uint64_t kSampleSeed = 1;

/// The picture, as SVG.
[[nodiscard]] std::string draw_plot(const Plot& plot);

}  // namespace tfdude::cli
