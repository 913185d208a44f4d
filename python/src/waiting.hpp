#pragma once

#include <string>

#include "session.hpp"

namespace tfdude::python {

/// A lookup that waits for its data, without the GIL. Unlike Client::lookup() it also ends when the
/// process gets a signal, so that Ctrl-C works, and when the interpreter ends.
[[nodiscard]] Result<StampedTransform> wait_for_lookup(const Session& session, const std::string& a,
                                                       const std::string& b, const Query& query,
                                                       Milliseconds wait);

/// Ends a wait without the GIL that looks for these once in a while.
/// @throws what a signal raises; SystemExit if the interpreter ends
void check_interrupted();
/// How often a wait looks.
inline constexpr Milliseconds kLook{50};

}  // namespace tfdude::python
