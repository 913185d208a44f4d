#pragma once

#include <string>

#include "partition/messages.hpp"

// Classifies requests.
namespace tfdude {

/// Whether a request changes nothing, so that a repeated one may be executed again.
[[nodiscard]] bool is_read_only(const Request& request);

/// Whether a request changes the set of frames or their parents.
[[nodiscard]] bool is_of_structure(const Request& request);

/// Whether a request changes values only.
[[nodiscard]] bool is_of_values(const Request& request);

/// One line for the log, for a change of the structure. Empty for others: values change too often
/// for it.
[[nodiscard]] std::string describe(const Request& request);

}  // namespace tfdude
