#pragma once

#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "command.hpp"
#include "path_printing.hpp"

// Paths: from frame A to frame B.
namespace tfdude::cli {

/// The ends of a path, and how transforms along it are printed.
struct Path : PathPrinting {
  /// Also explains the unit of angles.
  void add_printing(CLI::App& app);

  [[nodiscard]] nlohmann::json json(Source source, const StampedTransform& X_AB) const;
  /// Pose, deviations and stamp.
  [[nodiscard]] std::string text(Source source, const Common& common,
                                 const StampedTransform& X_AB) const;
  /// Prints one of both. @param more  for the end of the text. @return the exit status
  int print(Source source, const Common& common, const StampedTransform& X_AB,
            const std::string& more = "") const;
};

/// The joints that move unspecified edges of the path, and have had no sample: their positions are
/// assumed. Each by the name that samples have. Asks the owners, unless all edges are specified.
[[nodiscard]] std::vector<std::string> assumed_joints(Source source, const std::string& a,
                                                      const std::string& b,
                                                      const std::vector<std::string>& unspecified);

/// Adds --rate and --composed of a path that is followed.
void add_watch_options(CLI::App& app, WatchOptions& options);

/// Calls show() with the path's newest transform at the rate of the options, until interrupted. If
/// the path cannot be watched, or an owner is unreachable, reports that instead, each reason once.
/// @return the exit status
int follow(Client& client, const Common& common, const Path& path, const WatchOptions& options,
           const std::function<void(const StampedTransform&)>& show);

}  // namespace tfdude::cli
