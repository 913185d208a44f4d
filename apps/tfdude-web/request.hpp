#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "tfdude/base/time.hpp"

// What pages may ask for. They cannot change anything.
namespace tfdude::web {

/// Follow B in A; without names, nothing.
struct PairRequest {
  std::string a;
  std::string b;
};
/// Explain the pair that is followed, at the instant that is shown.
struct WhyRequest {};
/// Show an instant.
struct PastRequest {
  Time at;
};
/// Show what is new.
struct LiveRequest {};

/// A recording of so many bytes follows in pieces, to be shown to this page only.
struct UploadRequest {
  std::uint64_t bytes = 0;
};
/// The rest of that recording does not come.
struct CancelRequest {};
/// Show the robot instead of a recording.
struct RobotRequest {};

using PageRequest = std::variant<PairRequest, PastRequest, LiveRequest, WhyRequest, UploadRequest,
                                 CancelRequest, RobotRequest>;

/// Reads a message of a page. @return nothing if it is malformed
[[nodiscard]] std::optional<PageRequest> parse_request(std::string_view text);

}  // namespace tfdude::web
