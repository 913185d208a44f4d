#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/client/client.hpp"
#include "tfdude/math/earth.hpp"

// Answers for programs, as objects of JSON.
namespace tfdude::cli {

/// One line of JSON; invalid UTF-8 is replaced, and no zero has a sign.
[[nodiscard]] std::string dump(nlohmann::json object);

/// null for a value that is absent.
template <class T>
[[nodiscard]] nlohmann::json or_null(const std::optional<T>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json();
}
[[nodiscard]] nlohmann::json numbers_json(const Eigen::VectorXd& numbers);
/// Its rows.
[[nodiscard]] nlohmann::json matrix_json(const Eigen::MatrixXd& matrix);
/// In nanoseconds.
[[nodiscard]] nlohmann::json ns_json(const std::optional<Time>& time);

/// Adds a covariance under its key; if it is not complete, null there, and the rest under another
/// key, so that nobody takes it for that.
void add_covariance(nlohmann::json& object, const std::string& key, const Eigen::MatrixXd& sigma,
                    bool complete);
void add_covariance(nlohmann::json& object, const StatedCovariance& covariance);
/// Adds `stamp` [s] and `stamp_ns` to a transform's JSON; both are null if it holds for all times.
void add_stamp(nlohmann::json& object, const std::optional<Time>& stamp);

[[nodiscard]] nlohmann::json lookup_json(const std::string& a, const std::string& b,
                                         const Transform& X_AB,
                                         const std::vector<std::string>& partitions);
/// The same with the owners of its path, its stamp and what its covariance is based on.
[[nodiscard]] nlohmann::json lookup_json(const std::string& a, const std::string& b,
                                         const StampedTransform& X_AB,
                                         const std::vector<PathSegment>& path);
/// Latitude and longitude in degrees.
[[nodiscard]] nlohmann::json geodetic_json(const GeodeticPose& seen);
[[nodiscard]] nlohmann::json basis_json(const Basis& basis);
[[nodiscard]] nlohmann::json frame_json(const Frame& frame);
[[nodiscard]] nlohmann::json partition_json(const PartitionInfo& partition);
[[nodiscard]] nlohmann::json joint_json(const JointInfo& joint);
/// @param now  absent: the age is not known, since the stamps are of another clock
[[nodiscard]] nlohmann::json history_json(const HistoryInfo& history, std::optional<Time> now);
[[nodiscard]] nlohmann::json change_json(const Change& change);

}  // namespace tfdude::cli
