#pragma once

#include <cstdlib>
#include <string>

namespace tfdude::cli {

/// A variable of the environment; empty if there is none.
[[nodiscard]] inline std::string environment(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nothing sets variables
  return value == nullptr ? std::string() : std::string(value);
}

}  // namespace tfdude::cli
