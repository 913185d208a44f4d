#include "tfdude/math/point.hpp"

#include "../../rendering/format.hpp"
#include "../../rendering/json.hpp"
#include "../../rendering/text.hpp"
#include "../commands.hpp"
#include "../path.hpp"

namespace tfdude::cli {
namespace {

nlohmann::json json_of(const TransformedPoint& point) {
  nlohmann::json json{{"coordinates", numbers_json(point.coordinates)},
                      {"bias", numbers_json(point.bias)}};
  add_covariance(json, "covariance", point.of_specified, point.complete);
  return json;
}

struct PointCommand final : Question {
  explicit PointCommand(CLI::App& app) {
    path.add_ends(app);
    app.add_option("POINT", coordinates, "coordinates in B [m], three for each point")
        ->type_name("X Y Z ...")
        ->required();
    auto* option = app.add_option("--cov", cov,
                                  "covariance of each point: upper triangle row by row [m²]; "
                                  "default: the points are exact in B");
    option->type_name("6 NUMBERS")->expected(6);
    app.add_option("--stddev", stddev, "standard deviations of each point [m]")
        ->type_name("3 NUMBERS")
        ->expected(3)
        ->check(within(0, 1e9, "0 to 1e9"))
        ->excludes(option);
    app.add_flag("--direction", direction, "directions, which are only turned");
    app.add_flag("--joint", joint, "print the covariance of all points together");
    add_order(app, order);
    add_instant(app, at);
    add_recording(app);
    app.parse_complete_callback([this] {
      if (coordinates.size() % 3 == 0) return;
      throw CLI::ValidationError("POINT", "three coordinates for each point are needed, not " +
                                              std::to_string(coordinates.size()) + " in all");
    });
  }

  int ask_source(Source source, const Common& common) const override {
    const auto p_B = points();
    if (!p_B) return report(p_B.error(), common);
    const auto instant = optional_stamp(source, at);
    if (!instant) return report(instant.error(), common);
    Query query;
    query.at = *instant;
    query.order = static_cast<Order>(order);
    const auto X_AB = source.lookup(path.a, path.b, query);
    if (!X_AB) return report_cause(source, X_AB.error(), common);
    nlohmann::json json{{"from", path.a}, {"to", path.b}};
    std::string text;
    for (const TransformedPoint& p_A : transform(*X_AB, *p_B, query.order)) {
      json["points"].push_back(json_of(p_A));
      text += text_of(p_A, X_AB->basis.unspecified);
    }
    add_stamp(json, X_AB->stamp);
    json["basis"] = basis_json(X_AB->basis);
    const auto assumed = assumed_joints(source, path.a, path.b, X_AB->basis.unspecified);
    json["unsampled_joints"] = assumed;
    if (joint) {
      const Eigen::MatrixXd together = joint_covariance(*X_AB, *p_B, query.order);
      const bool complete = X_AB->covariance.complete();
      add_covariance(json, "joint_covariance", together, complete);
      text += std::string("covariance   of all points") + (complete ? "" : ", of the others") +
              (direction ? "\n" : " [m²]\n") + rows_text(together);
    }
    text += assumed_line(assumed);
    text += stamp_line(source, common, path.a, path.b, X_AB->stamp);
    return answer(common, json, text + describe(X_AB->basis));
  }

  [[nodiscard]] Eigen::Matrix3d own_covariance() const {
    Eigen::Matrix3d own = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < stddev.size(); ++i) {
      const auto axis = static_cast<Eigen::Index>(i);
      own(axis, axis) = stddev[i] * stddev[i];
    }
    if (cov.size() == 6)
      own << cov[0], cov[1], cov[2], cov[1], cov[3], cov[4], cov[2], cov[4], cov[5];
    return own;
  }

  [[nodiscard]] Result<std::vector<Point>> points() const {
    const Eigen::Matrix3d own = own_covariance();
    std::vector<Point> points;
    for (std::size_t i = 0; i + 2 < coordinates.size(); i += 3) {
      points.push_back({{coordinates[i], coordinates[i + 1], coordinates[i + 2]}, own, direction});
      if (auto ok = check_point(points.back()); !ok) {
        return fail_at("point " + std::to_string(i / 3 + 1), ok.error());
      }
    }
    return points;
  }

  [[nodiscard]] std::string text_of(const TransformedPoint& point,
                                    const std::vector<std::string>& unspecified) const {
    const auto line = [&](const char* name, const Eigen::Vector3d& v) {
      return format("%-13s%.6f  %.6f  %.6f%s\n", name, v.x(), v.y(), v.z(), direction ? "" : "  m");
    };
    std::string text = line(direction ? "direction" : "point", point.coordinates);
    if (!point.complete) text += "std dev      " + unspecified_text(unspecified) + "\n";
    text += line(point.complete ? "std dev" : "  of others",
                 point.of_specified.diagonal().cwiseMax(0.0).cwiseSqrt());
    constexpr double kVisible = 5e-7;
    return point.bias.cwiseAbs().maxCoeff() < kVisible ? text
                                                       : text + line("mean off by", point.bias);
  }

  Path path;
  std::vector<double> coordinates;  // three of each point
  std::vector<double> stddev;
  std::vector<double> cov;  // upper triangle
  bool direction = false;
  bool joint = false;  // print the covariance of all points together
  int order = 2;
};

}  // namespace

void add_point(Commands& commands) {
  commands.add<PointCommand>("point", "points of frame B, in frame A, with their covariance",
                             "point world hand_left 0 0 0.1");
}

}  // namespace tfdude::cli
