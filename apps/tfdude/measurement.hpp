#pragma once

#include <functional>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "tfdude/math/transform_spec.hpp"

#include "command.hpp"

namespace tfdude::cli {

/// A measurement that is fused into edges.
struct Measurement {
  using Send = std::function<Result<Observed>(const Transform&, std::optional<Time>)>;

  void add_options(CLI::App& app);
  /// Sends it and prints the result. @return the exit status
  int send(Client& client, const Common& common, const Send& send) const;

  TransformSpec spec;
  std::string stamp;  ///< as typed, see parse_stamp()
  ObserveOptions how;
};

}  // namespace tfdude::cli
