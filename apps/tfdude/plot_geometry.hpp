#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "tfdude/math/transform.hpp"

// What a picture of uncertainty is made of, before it is drawn.
namespace tfdude::cli {

/// An edge on the way from one frame to another.
struct Step {
  Transform X_PC;
  bool up = false;  ///< from the child to its parent
};

/// Of one standard deviation.
struct Ellipse {
  double major = 0;  ///< semi-axes
  double minor = 0;
  double angle = 0;  ///< of the major one, from the first coordinate to the second [rad]
};
[[nodiscard]] Ellipse ellipse_of(const Eigen::Matrix2d& covariance);

/// Points all round an ellipse of so many standard deviations about zero; a line there and back where it is flat.
[[nodiscard]] std::vector<Eigen::Vector2d> outline_of(const Ellipse& ellipse, double deviations);

struct Unit {
  const char* name;
  double metres;
};
/// In which numbers up to this one are easy to read on an axis.
[[nodiscard]] Unit unit_for(double metres);
/// The same for text, where nobody reads centimetres.
[[nodiscard]] Unit text_unit_for(double metres);
/// "31.2 mm": three digits, fewer where the rest are zeros.
[[nodiscard]] std::string length_text(double metres);
/// With a minus as wide as a plus, and zero without one.
[[nodiscard]] std::string number_text(double value, int decimals);

/// Multiples of 1, 2 or 5 times a power of ten within a range: at most so many, and not many fewer.
struct Ticks {
  double step = 1;
  std::vector<double> values;
};
[[nodiscard]] Ticks ticks_within(double low, double high, int most);
/// With as many decimals as the step has.
[[nodiscard]] std::string tick_label(double value, double step);

/// The origins of the path's frames, seen from the first.
[[nodiscard]] std::vector<Eigen::Vector3d> chain_of(const std::vector<Step>& steps);

/// Where the last frame's origin may be, seen from the first: each edge is drawn from its own Gaussian, as if it had nothing
/// to do with the others.
[[nodiscard]] std::vector<Eigen::Vector3d> sample_ends(const std::vector<Step>& steps, int count,
                                                       std::uint64_t seed);

}  // namespace tfdude::cli
