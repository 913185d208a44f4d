#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/base/export.hpp"

namespace tfdude {

/// How many characters have to be inserted, deleted, replaced, or swapped with their neighbour to
/// make one name of the other (optimal string alignment), upper and lower case being alike.
/// O(size · size).
[[nodiscard]] TFDUDE_EXPORT std::size_t edit_distance(std::string_view a, std::string_view b);

/// The names that were probably meant by this one, the nearest first: at most three. Those that
/// differ by at most a third of their characters, or that have it as a whole part between '/', '_'
/// and '.', or the other way round.
[[nodiscard]] TFDUDE_EXPORT std::vector<std::string> similar_names(
    std::string_view name, const std::vector<std::string>& known);

}  // namespace tfdude
