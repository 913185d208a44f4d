#pragma once

#include <string>
#include <vector>

#include "svg.hpp"

namespace tfdude::cli {

/// Size of most text in a plot [px], as in its style sheet.
inline constexpr double kLabelSize = 11.5;

/// A point with a name, and the radius that the name must keep clear [px].
struct Dot {
  Point at;
  double radius;
};

/// Writes the names of a path's frames beside their dots, as far as there is room in the panel.
void draw_names(Svg& svg, const Box& panel, const std::vector<std::string>& frames,
                const std::vector<Dot>& dots);

}  // namespace tfdude::cli
