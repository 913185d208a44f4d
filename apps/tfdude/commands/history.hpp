#pragma once

#include <optional>
#include <string>

#include "tfdude/client/client.hpp"

namespace tfdude::cli {

/// The history of an edge that has samples. @param now  absent: ages are not known
[[nodiscard]] std::string describe(const HistoryInfo& history, std::optional<Time> now);

}  // namespace tfdude::cli
