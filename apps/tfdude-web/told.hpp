#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/base/result.hpp"
#include "tfdude/types/change.hpp"
#include "tfdude/types/frame.hpp"
#include "tfdude/types/query.hpp"

// What pages are told in the same words of the robot and of a recording.
namespace tfdude::web {

/// B in A as the command line prints it in JSON, or the reason why there is none.
/// @param past  it is of the instant that the page has asked for
/// @param unreachable  why the values are old; empty: they are not
[[nodiscard]] std::string pair_text(const std::string& a, const std::string& b,
                                    const Result<StampedTransform>& X_AB,
                                    const std::vector<PathSegment>& path, bool past,
                                    const std::string& unreachable);

/// "warning" or "info".
[[nodiscard]] std::string level_of(ChangeKind kind);

/// An event for the list of the page.
[[nodiscard]] nlohmann::json event_json(nlohmann::json what, Time time, const std::string& level);

}  // namespace tfdude::web
