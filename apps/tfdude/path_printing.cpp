#include "path_printing.hpp"

#include "../rendering/json.hpp"
#include "../rendering/text.hpp"

namespace tfdude::cli {

std::string id_problem(const std::string& text) {
  return text.empty() ? "an empty text is no id of a frame" : "";
}

void PathPrinting::add_ends(CLI::App& app) {
  app.add_option("A", a, "the reference frame")->required()->check(id_problem);
  app.add_option("B", b, "the frame seen from A")->required()->check(id_problem);
}

void add_covariance_flag(CLI::App& app, bool& covariance) {
  app.add_flag("--cov", covariance, "print the full covariance");
}

void PathPrinting::add_printing(CLI::App& app) {
  add_covariance_flag(app, covariance);
  app.add_flag("--matrix", matrix, "print the pose as homogeneous 4x4 matrix");
  app.add_flag("--geodetic", geodetic,
               "A is an earth frame: print B's latitude, longitude, altitude and place on a map");
}

nlohmann::json PathPrinting::json(const StampedTransform& X_AB, const PathFacts& facts) const {
  auto object = lookup_json(a, b, X_AB, facts.path);
  object["unsampled_joints"] = facts.assumed;
  if (matrix) object["matrix"] = matrix_json(X_AB.pose.matrix());
  return object;
}

std::string PathPrinting::text(const StampedTransform& X_AB, const PathFacts& facts,
                               const AngleUnit& angles) const {
  return describe(X_AB, {angles, covariance, matrix}, X_AB.basis.unspecified) +
         assumed_line(facts.assumed) + facts.place + facts.stamp;
}

}  // namespace tfdude::cli
