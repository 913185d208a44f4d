#include "tfdude/base/id.hpp"
#include "tfdude/math/point.hpp"

#include "commands.hpp"
#include "uncertainty_render.hpp"

namespace tfdude::cli {
namespace {

Eigen::Matrix3d own_covariance(const Arguments& said) {
  Eigen::Matrix3d own = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < said.point_stddev.size(); ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    own(axis, axis) = said.point_stddev[i] * said.point_stddev[i];
  }
  if (said.point_cov.size() != 6) return own;
  const auto& c = said.point_cov;
  own << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
  return own;
}

Result<std::vector<Point>> points_of(const Arguments& said) {
  const Eigen::Matrix3d own = own_covariance(said);
  std::vector<Point> points;
  for (std::size_t i = 0; i + 2 < said.points.size(); i += 3) {
    points.push_back(
        {{said.points[i], said.points[i + 1], said.points[i + 2]}, own, said.direction});
    if (auto ok = check_point(points.back()); !ok) {
      return fail_at("point " + std::to_string(i / 3 + 1), ok.error());
    }
  }
  return points;
}

nlohmann::json json_of(const TransformedPoint& point) {
  const auto list = [](const Eigen::Vector3d& v) { return nlohmann::json{v.x(), v.y(), v.z()}; };
  nlohmann::json json{{"coordinates", list(point.coordinates)}, {"bias", list(point.bias)}};
  add_covariance(json, "covariance", point.of_specified, point.complete);
  return json;
}

std::string describe(const TransformedPoint& point, const Arguments& said,
                     const std::vector<std::string>& unspecified) {
  const char* unit = said.direction ? "" : "  m";
  const auto line = [&](const char* name, const Eigen::Vector3d& v) {
    return format("%-13s%.6f  %.6f  %.6f%s\n", name, v.x(), v.y(), v.z(), unit);
  };
  std::string text = line(said.direction ? "direction" : "point", point.coordinates);
  if (!point.complete) text += "std dev      " + unspecified_text(unspecified) + "\n";
  text += line(point.complete ? "std dev" : "  of others",
               point.of_specified.diagonal().cwiseMax(0.0).cwiseSqrt());
  constexpr double kVisible = 5e-7;
  return point.bias.cwiseAbs().maxCoeff() < kVisible ? text
                                                     : text + line("mean off by", point.bias);
}

}  // namespace

int run_point(Source source, const Arguments& arguments) {
  const auto points = points_of(arguments);
  if (!points) return report(points.error(), arguments);
  const auto at = optional_stamp(source, arguments.stamp);
  if (!at) return report(at.error(), arguments);
  Query query;
  query.at = *at;
  query.order = order_of(arguments);
  const auto X_AB = source.lookup(arguments.id, arguments.other, query);
  if (!X_AB) return refuse(source, X_AB.error(), arguments);
  nlohmann::json json{{"from", arguments.id}, {"to", arguments.other}};
  std::string text;
  for (const TransformedPoint& p_A : transform(*X_AB, *points, query.order)) {
    json["points"].push_back(json_of(p_A));
    text += describe(p_A, arguments, X_AB->basis.unspecified);
  }
  add_stamp(json, X_AB->stamp);
  json["basis"] = basis_json(X_AB->basis);
  if (arguments.joint_covariance) {
    const Eigen::MatrixXd joint = joint_covariance(*X_AB, *points, query.order);
    const bool complete = X_AB->covariance.complete();
    add_covariance(json, "joint_covariance", joint, complete);
    text += std::string("covariance   of all points") + (complete ? "" : ", of the others") +
            (arguments.direction ? "\n" : " [m²]\n") + rows_text(joint);
  }
  if (X_AB->stamp && !arguments.json) {
    text += stamp_line(source, arguments, *X_AB->stamp);
  }
  return answer(arguments, json, text + describe(X_AB->basis));
}

}  // namespace tfdude::cli
