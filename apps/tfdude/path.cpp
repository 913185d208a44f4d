#include "path.hpp"

#include <optional>
#include <set>

#include "../rendering/json.hpp"
#include "../rendering/text.hpp"
#include "answer.hpp"
#include "options.hpp"
#include "stamps.hpp"

namespace tfdude::cli {

void add_watch_options(CLI::App& app, WatchOptions& options) {
  options.rate = kRedrawRate;
  add_rate(app, options.rate, "output rate, and the owners' highest rate of sending [Hz]");
  app.add_flag("--composed", options.composed,
               "each owner sends its part of the path as one transform");
}

void Path::add_printing(CLI::App& app) {
  PathPrinting::add_printing(app);
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
  PathFacts facts;
  facts.path = source.path(a, b).value_or(std::vector<PathSegment>());
  facts.assumed = assumed_joints(source, a, b, X_AB.basis.unspecified);
  auto object = PathPrinting::json(X_AB, facts);
  if (geodetic) {
    const auto seen = geodetic_pose(X_AB);
    object["geodetic"] = seen ? geodetic_json(*seen) : nlohmann::json();
  }
  return object;
}

std::string Path::text(Source source, const Common& common, const StampedTransform& X_AB) const {
  PathFacts facts;
  facts.assumed = assumed_joints(source, a, b, X_AB.basis.unspecified);
  if (geodetic) {
    const auto seen = geodetic_pose(X_AB);
    facts.place =
        seen ? describe(*seen, common.angles) : "geodetic     none: " + seen.error().message + "\n";
  }
  facts.stamp = stamp_line(source, common, a, b, X_AB.stamp);
  return PathPrinting::text(X_AB, facts, common.angles);
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
