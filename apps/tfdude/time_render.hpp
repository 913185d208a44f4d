#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/client/client.hpp"

#include "angles.hpp"

// Stamps, histories and followed paths as text for people, and as JSON for programs.
namespace tfdude::cli {

/// "1700000000.123456789": seconds since the epoch, exact.
[[nodiscard]] std::string seconds_of(Time stamp);

// Without `now`, ages are not known: the stamps are of another clock.

/// The line with the stamp of a transform.
[[nodiscard]] std::string describe_stamp(Time stamp, std::optional<Time> now);
/// The same of a recording, which has no present.
[[nodiscard]] std::string describe_recorded_stamp(Time stamp, std::optional<Time> end);

/// Adds `stamp` [s] and `stamp_ns` to a transform's JSON; both are null if it holds for all times.
void add_stamp(nlohmann::json& json, const std::optional<Time>& stamp);

/// The history of one edge, or that it has none.
[[nodiscard]] std::string describe(const HistoryInfo& history, std::optional<Time> now);
[[nodiscard]] nlohmann::json history_json(const HistoryInfo& history, std::optional<Time> now);

/// The total of a partition's histories.
struct HistorySum {
  std::size_t edges = 0;
  std::size_t samples = 0;
  std::size_t bytes = 0;
};
[[nodiscard]] HistorySum sum_of(const std::vector<HistoryInfo>& histories);
[[nodiscard]] std::string describe(const HistorySum& sum);

/// A transform in a fixed, small number of lines: position, angles, standard deviations, age.
[[nodiscard]] std::string echo_lines(const std::string& a, const std::string& b,
                                     const StampedTransform& X_AB, std::optional<Time> now,
                                     const AngleUnit& angles);

/// One partition's dynamic edges as a table.
[[nodiscard]] std::string monitor_table(const std::string& partition,
                                        const std::vector<HistoryInfo>& histories,
                                        std::optional<Time> now);

}  // namespace tfdude::cli
