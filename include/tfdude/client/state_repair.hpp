#pragma once

#include <string>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/types/options.hpp"

namespace tfdude {

/// Leaves out what is damaged in a partition's stored state: erases the rows whose checksums are
/// wrong, and what belongs to them, so that Node::open() serves the rest; and all changes that were
/// stored after the first damage of its log. Frames below a frame that was left out wait for it.
/// Does nothing if there is no file, or nothing is wrong.
/// @return what was erased, such as "frames 'hand'"; kState (naming the file) if it is in use, or
///   damaged in another way. Thread-safe.
[[nodiscard]] TFDUDE_EXPORT Result<std::vector<std::string>> drop_damaged_state(
    const std::string& partition, const NodeOptions& options);

}  // namespace tfdude
