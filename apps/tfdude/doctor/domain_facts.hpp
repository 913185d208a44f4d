#pragma once

#include "tfdude/types/options.hpp"

#include "facts.hpp"

// Facts about the domain, and about other participants of this host.
namespace tfdude::cli {

/// Finds out all facts. Joins the domain for as long as a command does, and others of this host for
/// a moment if no partition was discovered.
[[nodiscard]] Facts gather_facts(const Options& options);

}  // namespace tfdude::cli
