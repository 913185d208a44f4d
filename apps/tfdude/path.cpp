#include "path.hpp"

#include <optional>
#include <set>

#include "../rendering/json.hpp"
#include "../rendering/text.hpp"
#include "answer.hpp"
#include "options.hpp"
#include "stamps.hpp"

namespace tfdude::cli {

void Path::add_ends(CLI::App& app) {
  app.add_option("A", a, "the reference frame")->required();
  app.add_option("B", b, "the frame seen from A")->required();
}

void add_covariance_flag(CLI::App& app, bool& covariance) {
  app.add_flag("--cov", covariance, "print the full covariance");
}

void add_watch_options(CLI::App& app, WatchOptions& options) {
  options.rate = kRedrawRate;
  add_rate(app, options.rate, "output rate, and the owners' highest rate of sending [Hz]");
  app.add_flag("--composed", options.composed,
               "each owner sends its part of the path as one transform");
}

void Path::add_printing(CLI::App& app) {
  add_covariance_flag(app, covariance);
  app.add_flag("--matrix", matrix, "print the pose as homogeneous 4x4 matrix");
  app.add_flag("--geodetic", geodetic,
               "A is an earth frame: print B's latitude, longitude, altitude and place on a map");
  explain_angles(app);
}

std::vector<std::string> assumed_joints(Source source, const std::string& a, const std::string& b,
                                        const std::vector<std::string>& unspecified) {
  std::set<std::string> names;
  if (unspecified.empty()) return {};
  const auto path = source.path(a, b);
  const std::set<std::string> moved(unspecified.begin(), unspecified.end());
  std::set<std::string> asked;
  for (const PathSegment& segment : path.value_or(std::vector<PathSegment>())) {
    if (!asked.insert(segment.partition).second) continue;
    const auto joints = source.joints(segment.partition);
    if (!joints) continue;
    for (const JointInfo& joint : *joints) {
      if (joint.measured || moved.count(joint.frame) == 0) continue;
      names.insert(joint.mimic ? joint.mimic->joint : joint.name);
    }
  }
  return {names.begin(), names.end()};
}

nlohmann::json Path::json(Source source, const StampedTransform& X_AB) const {
  const auto path = source.path(a, b).value_or(std::vector<PathSegment>());
  auto object = lookup_json(a, b, X_AB, path);
  object["unsampled_joints"] = assumed_joints(source, a, b, X_AB.basis.unspecified);
  if (matrix) object["matrix"] = matrix_json(X_AB.pose.matrix());
  if (geodetic) {
    const auto seen = geodetic_pose(X_AB);
    object["geodetic"] = seen ? geodetic_json(*seen) : nlohmann::json();
  }
  return object;
}

std::string Path::text(Source source, const Common& common, const StampedTransform& X_AB) const {
  std::string text = describe(X_AB, {common.angles, covariance, matrix}, X_AB.basis.unspecified);
  text += assumed_line(assumed_joints(source, a, b, X_AB.basis.unspecified));
  if (geodetic) {
    const auto seen = geodetic_pose(X_AB);
    text +=
        seen ? describe(*seen, common.angles) : "geodetic     none: " + seen.error().message + "\n";
  }
  return text + stamp_line(source, common, a, b, X_AB.stamp);
}

int Path::print(Source source, const Common& common, const StampedTransform& X_AB,
                const std::string& more) const {
  if (common.json) return answer(common, json(source, X_AB), "");
  return answer(common, {}, text(source, common, X_AB) + more);
}

int follow(Client& client, const Common& common, const Path& path, const WatchOptions& options,
           const std::function<void(const StampedTransform&)>& show) {
  std::optional<PathWatch> watch;
  std::optional<Error> reported;
  const auto complain = [&](const Error& error) {
    const bool again =
        reported && reported->code == error.code && reported->message == error.message;
    if (!again) (void)report(with_hint(client, error, common), common);
    reported = error;
  };
  do {
    if (!watch) {
      auto watched = client.watch(path.a, path.b, options);
      if (!watched) {
        complain(cause_of(client, watched.error(), common));
        continue;
      }
      watch = *std::move(watched);
    }
    if (const auto health = watch->health(); !health) {
      complain(health.error());
      continue;
    }
    const auto X_AB = watch->latest();
    if (X_AB) {
      show(*X_AB);
      reported.reset();
    } else {
      complain(X_AB.error());
    }
  } while (!interrupted_within(1.0 / options.rate));
  return kDone;
}

}  // namespace tfdude::cli
