#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"

#include "../../rendering/quantities.hpp"

namespace tfdude::cli {

/// A partition and, if it answers, the total of its histories.
struct PartitionRow {
  PartitionInfo partition;
  std::optional<HistorySum> history;
};
[[nodiscard]] std::string partition_table(const std::vector<PartitionRow>& rows);

}  // namespace tfdude::cli
