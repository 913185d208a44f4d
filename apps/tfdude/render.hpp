#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/client/client.hpp"

#include "angles.hpp"
#include "time_render.hpp"

// Answers as text for people, and as JSON for programs.
namespace tfdude::cli {

/// All frames as trees, each with its owner.
/// @param unreachable  the partitions that do not answer
[[nodiscard]] std::string draw_tree(const std::vector<Frame>& frames,
                                    const std::vector<std::string>& unreachable);

/// A partition and, if it answers, the total of its histories.
struct PartitionRow {
  PartitionInfo partition;
  std::optional<HistorySum> history;
};
[[nodiscard]] std::string partition_table(const std::vector<PartitionRow>& rows);

/// How a transform or velocity is printed.
struct Shown {
  AngleUnit angles = kRadian;
  bool covariance = false;  ///< the full one
  bool matrix = false;      ///< the pose as a homogeneous matrix
};

/// @param unspecified  the edges whose covariance is unspecified
[[nodiscard]] std::string describe(const Transform& X_AB, const Shown& shown,
                                   const std::vector<std::string>& unspecified = {});

/// A table of the covariance, whose last three rows and columns are of angles.
[[nodiscard]] std::string matrix_table(const Matrix6d& sigma, const AngleUnit& angles);

/// The rows of a matrix, as text and in JSON.
[[nodiscard]] std::string rows_text(const Eigen::MatrixXd& matrix);
[[nodiscard]] nlohmann::json matrix_json(const Eigen::MatrixXd& matrix);

/// Adds a covariance under its key; if it is not complete, null there, and the rest under another
/// key, so that nobody takes it for that.
void add_covariance(nlohmann::json& json, const std::string& key, const Eigen::MatrixXd& sigma,
                    bool complete);

/// "unspecified for odom, base"
[[nodiscard]] std::string unspecified_text(const std::vector<std::string>& edges);

[[nodiscard]] nlohmann::json lookup_json(const std::string& a, const std::string& b,
                                         const Transform& X_AB,
                                         const std::vector<std::string>& partitions);
[[nodiscard]] nlohmann::json frame_json(const Frame& frame);
[[nodiscard]] nlohmann::json partition_json(const PartitionInfo& partition);
[[nodiscard]] nlohmann::json change_json(const Change& change);

/// One line of JSON; invalid UTF-8 is replaced, and no zero has a sign.
[[nodiscard]] std::string dump(nlohmann::json json);

}  // namespace tfdude::cli
