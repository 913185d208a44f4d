#pragma once

#include <optional>

#include "tfdude/base/export.hpp"
#include "tfdude/types/one_shot.hpp"
#include "tfdude/types/options.hpp"

// Lookups of a program that asks once and then ends, as `tfdude lookup` does: without joining the
// domain, which takes longer than the answer.
namespace tfdude {

/// Looks X_AB up by asking another process of this computer and user that serves a partition in the
/// domain. It reads its own memory and that of others (docs/memory.md). Takes 0.1 ms, and at most
/// some milliseconds.
/// @return empty: nobody there could answer, so a Client has to ask, which also says why not. So it
///   is with keys, a discovery server or without shared memory in the options, if an owner of the
///   path is on another computer, and for every lookup that fails
[[nodiscard]] TFDUDE_EXPORT std::optional<OneShotAnswer> look_up_once(
    const OneShotQuestion& question, const Options& options);

}  // namespace tfdude
