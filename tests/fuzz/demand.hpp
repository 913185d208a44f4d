#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>

#include "tfdude/base/id.hpp"
#include "tfdude/base/result.hpp"

namespace tfdude::fuzz {

/// Ends the harness with a finding if a property does not hold.
inline void demand(bool holds, const char* property) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", property);
  std::abort();
}

/// A message must be printable, because users read it on a terminal.
inline void demand_printable(const Error& error) {
  demand(!error.message.empty(), "an error has a message");
  demand(quote(error.message) == "'" + error.message + "'", "a message can be printed");
}

}  // namespace tfdude::fuzz
