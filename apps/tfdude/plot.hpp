#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tfdude/types/query.hpp"

#include "plot_geometry.hpp"

// Where a frame is, with its uncertainty, as a picture: what is to be drawn in, SVG out.
namespace tfdude::cli {

struct Plot {
  StampedTransform X_AB;
  std::vector<std::string> frames;  ///< of the path, from A to B
  std::vector<Step> steps;          ///< between them
  int samples = 0;                  ///< how many points to draw
};

inline constexpr std::uint64_t kSampleSeed = 1;

/// The picture, as SVG.
[[nodiscard]] std::string draw_plot(const Plot& plot);

}  // namespace tfdude::cli
