#pragma once

#include <string>
#include <vector>

#include "svg.hpp"

namespace tfdude::cli {

/// Of most text in a plot, as its style sheet says [px].
inline constexpr double kLabelSize = 11.5;

/// What has a name, and how far from it that may begin.
struct Dot {
  Point at;
  double radius;
};

/// Writes the names of the frames of a path beside their dots, those for which there is room in the panel.
void draw_names(Svg& svg, const Box& panel, const std::vector<std::string>& frames,
                const std::vector<Dot>& dots);

}  // namespace tfdude::cli
