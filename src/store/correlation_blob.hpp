#pragma once

#include <string>

#include "tfdude/base/result.hpp"

#include "tree/path_correlation.hpp"

namespace tfdude {

/// Serializes a correlation for storage; all numbers are little-endian:
/// - whether it is unknown (1 byte);
/// - the number of common errors (4 bytes), and for each its source, whether it subtracts (1), the
///   number of columns (4), and the loading column by column;
/// - the number of edges that it was observed with (4), and for each its id.
/// The length (4) precedes each text.
[[nodiscard]] std::string to_blob(const Correlation& correlation);

/// @return kState or kInvalidInput: cut short, or not a valid correlation.
[[nodiscard]] Result<Correlation> correlation_from(const std::string& blob);

/// As to_blob() of what observations have found. StoredCorrelation::given follows if there is one:
/// the quaternion x, y, z, w, and the translation.
[[nodiscard]] std::string observed_blob(const StoredCorrelation& correlation);

/// Reads what observed_blob() has written.
[[nodiscard]] Result<void> read_observed(const std::string& blob, StoredCorrelation& correlation);

}  // namespace tfdude
