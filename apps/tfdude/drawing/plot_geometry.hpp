#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "tfdude/math/transform.hpp"

// Computes the contents of a picture of uncertainty, before it is drawn.
namespace tfdude::cli {

/// An edge of the path from one frame to another.
struct Step {
  Transform X_PC;
  bool up = false;  ///< whether the path goes from the child to its parent
};

/// The ellipse of one standard deviation.
struct Ellipse {
  double major = 0;  ///< semi-axis
  double minor = 0;  ///< semi-axis
  double angle = 0;  ///< of the major axis, from the first coordinate to the second [rad]
};
[[nodiscard]] Ellipse ellipse_of(const Eigen::Matrix2d& covariance);

/// Points on the ellipse of so many standard deviations about zero. If the minor axis is zero, they
/// form a line there and back.
[[nodiscard]] std::vector<Eigen::Vector2d> outline_of(const Ellipse& ellipse, double deviations);

struct Unit {
  const char* name;
  double metres;
};
/// The unit in which lengths up to this one are easy to read on an axis.
[[nodiscard]] Unit unit_for(double metres);
/// The same for text, where centimetres are not usual.
[[nodiscard]] Unit text_unit_for(double metres);
/// "31.2 mm": three significant digits, without zeros at the end.
[[nodiscard]] std::string length_text(double metres);
/// A number with the minus sign U+2212, which is as wide as a plus; zero has no sign.
[[nodiscard]] std::string number_text(double value, int decimals);

/// The multiples within a range of 1, 2 or 5 times a power of ten: at most so many, and not many
/// fewer.
struct Ticks {
  double step = 1;
  std::vector<double> values;
};
[[nodiscard]] Ticks ticks_within(double low, double high, int most);
/// The value with as many decimals as the step has.
[[nodiscard]] std::string tick_label(double value, double step);

/// The origins of the path's frames, in the first frame [m].
[[nodiscard]] std::vector<Eigen::Vector3d> chain_of(const std::vector<Step>& steps);

/// Possible origins of the last frame, in the first frame [m]. Each edge is sampled from its own
/// Gaussian, as if it were independent of the others.
[[nodiscard]] std::vector<Eigen::Vector3d> sample_ends(const std::vector<Step>& steps, int count,
                                                       std::uint64_t seed);

}  // namespace tfdude::cli
