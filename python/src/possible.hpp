#pragma once

#include <optional>

#include "tfdude/base/result.hpp"

namespace tfdude::python {

/// Whether a lookup would succeed, or why not: the answer to can_lookup().
struct Possible {
  std::optional<Error> why_not;
};

}  // namespace tfdude::python
