#include "text.hpp"

#include <cmath>

#include "tfdude/base/id.hpp"
#include "tfdude/math/belief.hpp"
#include "tfdude/math/perturbation.hpp"

#include "format.hpp"
#include "quantities.hpp"
#include "table.hpp"

namespace tfdude::cli {
namespace {

std::string describe_pose(const Pose& X_AB, const Shown& shown) {
  std::string text;
  if (shown.matrix) {
    const Eigen::Matrix4d matrix = X_AB.matrix();
    for (int row = 0; row < 4; ++row) {
      text += row == 0 ? "matrix     " : "           ";
      for (int column = 0; column < 4; ++column) {
        text += format(" % .9f", matrix(row, column));
      }
      text += "\n";
    }
    return text;
  }
  const Eigen::Vector3d t = X_AB.translation();
  const Eigen::Vector4d q = X_AB.rotation().coeffs();
  const Eigen::Vector3d rpy = to_rpy(X_AB.rotation());
  text = format("translation  %.6f  %.6f  %.6f  m\n", t.x(), t.y(), t.z());
  text += format("quaternion   %.6f  %.6f  %.6f  %.6f  (x y z w)\n", q[0], q[1], q[2], q[3]);
  return text + "rpy          " + angles_text(rpy.x(), rpy.y(), rpy.z(), shown.angles) + "\n";
}

bool is_prismatic(const JointInfo& joint) { return joint.type == JointType::kPrismatic; }

// As many words as fit, at least one, and how many there are besides.
std::string joined_within(const std::vector<std::string>& words, std::size_t columns) {
  constexpr std::size_t kAndMore = 12;
  const std::string all = joined(words);
  if (all.size() <= columns) return printable(all);
  std::vector<std::string> some{words.front()};
  std::size_t size = words.front().size();
  for (std::size_t i = 1; i < words.size(); ++i) {
    size += 2 + words[i].size();
    if (size + kAndMore > columns) break;
    some.push_back(words[i]);
  }
  const std::size_t more = words.size() - some.size();
  return printable(joined(some)) + (more > 0 ? " and " + std::to_string(more) + " more" : "");
}

}  // namespace

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (&word == &words.front() ? "" : ", ") + word;
  return text;
}

std::string unspecified_text(const std::vector<std::string>& edges) {
  if (edges.empty()) return "unspecified";
  return "unspecified for " + joined_within(edges, 50);
}

std::string assumed_text(const std::vector<std::string>& joints) {
  if (joints.empty()) return {};
  return std::to_string(joints.size()) +
         (joints.size() == 1 ? " joint has had no sample: " : " joints have had no sample: ") +
         joined_within(joints, 38);
}

std::string assumed_line(const std::vector<std::string>& joints) {
  return joints.empty() ? "" : "assumed      " + assumed_text(joints) + "\n";
}

std::string rows_text(const Eigen::MatrixXd& matrix) {
  std::string text;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
      text += format(" % .5e", matrix(row, column));
    }
    text += "\n";
  }
  return text;
}

std::string matrix_table(const Matrix6d& sigma, const AngleUnit& angles) {
  Twist scale = Twist::Ones();
  scale.tail<3>().setConstant(angles.per_radian);
  std::string text;
  for (const char* axis : {"x", "y", "z", "rx", "ry", "rz"}) text += format(" %12s", axis);
  return text + "\n" + rows_text(scale.asDiagonal() * sigma * scale.asDiagonal());
}

std::string describe(const Transform& X_AB, const Shown& shown,
                     const std::vector<std::string>& unspecified) {
  std::string text = describe_pose(X_AB.pose, shown);
  const auto s = stddev_in_parent(X_AB);
  const bool complete = X_AB.covariance.complete();
  if (!complete) text += "std dev      " + unspecified_text(unspecified) + "\n";
  const std::string along = format("%s%.6f  %.6f  %.6f  m",
                                   complete ? "std dev      " : "  of others  ", s[0], s[1], s[2]);
  const std::string about = angles_text(s[3], s[4], s[5], shown.angles);
  const std::string margin(13, ' ');
  if (along.size() + 3 + about.size() <= 80) {
    text +=
        along + "   " + about + "\n" + margin + kAxesOfTranslation + ", " + kAxesOfRotation + "\n";
  } else {
    text +=
        along + "  " + kAxesOfTranslation + "\n" + margin + about + "  " + kAxesOfRotation + "\n";
  }
  if (!shown.covariance) return text;
  text += complete ? "covariance   (translation first, of the right perturbation; m, "
                   : "covariance   of the others (translation first; m, ";
  text += shown.angles.name + std::string(") in B's axes\n");
  return text + matrix_table(X_AB.covariance.of_specified().matrix(), shown.angles);
}

std::string describe(const GeodeticPose& seen, const AngleUnit& angles) {
  const Eigen::Vector3d rpy = to_rpy(seen.X_NB.pose.rotation());
  std::string text = format("latitude     %.9f deg\nlongitude    %.9f deg\naltitude     %.4f m\n",
                            seen.place.latitude, seen.place.longitude, seen.place.altitude);
  text += "rpy to ENU   " + angles_text(rpy.x(), rpy.y(), rpy.z(), angles) + "\n";
  if (seen.X_NB.covariance.complete()) {
    const auto s = stddev_in_parent(seen.X_NB);
    text += format("std dev ENU  %.6f  %.6f  %.6f  m\n", s[0], s[1], s[2]);
  }
  return text + format("%s %s  %.4f  %.4f  m, scale %.8f, convergence %.6f deg\n",
                       seen.utm.zone == 0 ? "ups         " : "utm         ",
                       zone_text(seen.utm).c_str(), seen.utm.easting, seen.utm.northing,
                       seen.utm.scale, seen.utm.convergence * kDegrees);
}

std::string describe(const Basis& basis) {
  // Sources with a name that somebody gave, and those that observations have left.
  std::vector<std::string> named;
  for (const std::string& source : basis.sources) {
    if (source.rfind(kObservedPrefix, 0) != 0) named.push_back(quote(source));
  }
  std::string text;
  const auto add = [&text](const std::string& line) {
    text += (text.empty() ? "correlation  " : "             ") + line + "\n";
  };
  if (!named.empty()) add("edges share the error of " + joined(named) + ", which is accounted for");
  if (named.size() < basis.sources.size()) {
    add("edges were corrected by one measurement, which is accounted for");
  }
  if (basis.bound) add("of some edges is not known: the std dev is an upper bound");
  return text + (basis.order == Order::kFourth ? "order        fourth\n" : "");
}

std::string seconds_of(Time stamp) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t ns = nanoseconds(stamp);
  return format("%lld.%09lld", static_cast<long long>(ns / kSecond),
                static_cast<long long>(ns % kSecond));
}

std::string ago(Time stamp, std::optional<Time> now) {
  if (!now) return "of another clock";
  const double age = seconds(*now - stamp);
  return age < 0 ? format("%.6f s ahead of now", -age) : format("%.6f s ago", age);
}

std::string describe_stamp(Time stamp, std::optional<Time> now) {
  return "stamp        " + seconds_of(stamp) + "  (" + ago(stamp, now) + ")\n";
}

std::string describe_recorded_stamp(Time stamp, std::optional<Time> end) {
  if (!end) return describe_stamp(stamp, end);
  const double age = seconds(*end - stamp);
  const std::string when =
      age < 0 ? format("%.6f s after the end", -age) : format("%.6f s before the end", age);
  return "stamp        " + seconds_of(stamp) + "  (" + when + ")\n";
}

double in_unit(const JointInfo& joint, double value, const AngleUnit& angles) {
  return is_prismatic(joint) ? value : value * angles.per_radian;
}

const char* unit_of(const JointInfo& joint, const AngleUnit& angles) {
  return is_prismatic(joint) ? "m" : angles.name;
}

std::string position_cell(const JointInfo& joint, double value, const AngleUnit& angles,
                          std::size_t columns) {
  constexpr int kDecimals = 5;  // of metres and radians
  const int decimals = is_prismatic(joint) || angles.per_radian == 1 ? kDecimals : 3;
  return number(in_unit(joint, value, angles), decimals, columns);
}

std::string limits_of(const JointInfo& joint, const AngleUnit& angles) {
  if (!joint.limits) return "none";
  const auto limit = [&](double value) {
    const double shown = in_unit(joint, value, angles);
    return std::abs(shown) < 9999.5 ? format("%.4g", shown) : format("%.2g", shown);
  };
  return limit(joint.limits->lower) + ".." + limit(joint.limits->upper);
}

}  // namespace tfdude::cli
