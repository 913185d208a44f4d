#pragma once

#include <string>
#include <string_view>

#include "partition/messages.hpp"
#include "transport/fastdds/compat.hpp"

// Converts parts that several messages have from the network.
namespace tfdude::fastdds {

[[nodiscard]] inline std::string_view text(const wire::Identifier& id) {
  return {id.c_str(), id.size()};
}
[[nodiscard]] inline std::string string_of(const wire::Identifier& id) {
  return std::string(text(id));
}

/// @return kInvalidInput naming the source, or the part of unknown correlation.
[[nodiscard]] Result<PathCorrelation> read_path_correlation(const wire::Correlation& body);
[[nodiscard]] Result<Correlation> read_correlation(const wire::Correlation& body);

}  // namespace tfdude::fastdds
