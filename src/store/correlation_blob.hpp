#pragma once

#include <string>

#include "tfdude/base/result.hpp"

#include "tree/path_correlation.hpp"

namespace tfdude {

/// A correlation as it is stored, in the machine's byte order: whether it is unknown (1 byte); the number of common errors
/// (4 bytes), each its source, whether it subtracts (1), its columns (4), the loading column by column; the number of edges
/// that it was observed with (4), each its id. A text has its length (4) before it.
[[nodiscard]] std::string to_blob(const Correlation& correlation);

/// @return kState or kInvalidInput: cut short, or something that no correlation is.
[[nodiscard]] Result<Correlation> correlation_from(const std::string& blob);

}  // namespace tfdude
