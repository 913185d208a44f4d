#pragma once

#include <string>

#include "partition/messages.hpp"

// Classifies requests.
namespace tfdude {

/// Whether a request changes nothing, so that a repeated one may be executed again.
[[nodiscard]] bool is_read_only(const Request& request);

/// Whether a request needs the permission to change something. An observation does.
[[nodiscard]] bool is_change(const Request& request);

/// Whether a request changes the set of frames or their parents.
[[nodiscard]] bool is_of_structure(const Request& request);

/// Whether a change by the owner's own process is stored before the call returns: one of the
/// structure, or of what edges have in common. Other owners may have stored their part of that.
[[nodiscard]] bool is_stored_first(const Request& request);

/// Whether a request changes values only.
[[nodiscard]] bool is_of_values(const Request& request);

/// One line for the log, for a change of the structure. Empty for others: values change too often
/// for it.
[[nodiscard]] std::string describe(const Request& request);

/// What a request tries to do, for the error of a requester that may not: a verb and its object.
[[nodiscard]] std::string attempt_of(const Request& request);

}  // namespace tfdude
