#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "tfdude/types/frame.hpp"
#include "tfdude/types/query.hpp"

#include "../rendering/angles.hpp"

namespace tfdude::cli {

/// What is known of a path besides its transform.
struct PathFacts {
  std::vector<PathSegment> path{};     ///< its owners
  std::vector<std::string> assumed{};  ///< joints that have had no sample
  std::string place{};                 ///< lines about the place on the Earth
  std::string stamp{};                 ///< the line about the stamp
};

/// What is wrong with what was typed for the id of a frame; empty: nothing.
[[nodiscard]] std::string id_problem(const std::string& text);

/// The ends of a path, and how transforms along it are printed, whoever has found them.
struct PathPrinting {
  /// Adds A and B.
  void add_ends(CLI::App& app);
  /// Adds --cov, --matrix and --geodetic.
  void add_printing(CLI::App& app);

  [[nodiscard]] nlohmann::json json(const StampedTransform& X_AB, const PathFacts& facts) const;
  /// Pose, deviations and stamp.
  [[nodiscard]] std::string text(const StampedTransform& X_AB, const PathFacts& facts,
                                 const AngleUnit& angles) const;

  std::string a;
  std::string b;
  bool covariance = false;  ///< print the full one
  bool matrix = false;      ///< print the pose as a matrix
  bool geodetic = false;    ///< A is an earth frame: print the place of B
};

/// Adds --cov alone.
void add_covariance_flag(CLI::App& app, bool& covariance);

}  // namespace tfdude::cli
