#pragma once

#include "tfdude/types/options.hpp"

#include "facts.hpp"

// What the domain tells, and whoever else is on this host.
namespace tfdude::cli {

/// Finds out all facts. Joins the domain for as long as a command does, and others of this host for
/// a moment if nobody was met.
[[nodiscard]] Facts gather_facts(const Options& options);

}  // namespace tfdude::cli
