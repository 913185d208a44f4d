#pragma once

#include <string>

#include "partition/messages.hpp"

// Which requests are of what kind.
namespace tfdude {

/// Whether a request changes nothing, so that a repeated one may be answered anew.
[[nodiscard]] bool is_read_only(const Request& request);

/// Whether a request changes which frames there are, or where they hang.
[[nodiscard]] bool is_of_structure(const Request& request);

/// Whether a request changes values alone.
[[nodiscard]] bool is_of_values(const Request& request);

/// One line for the log, of a change of the structure; empty of others: values change too often for it.
[[nodiscard]] std::string describe(const Request& request);

}  // namespace tfdude
