#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

// What clients of Foxglove's protocol may ask for.
namespace tfdude::web::foxglove {

struct Subscribe {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> subscriptions;  ///< id, channel
};
struct Unsubscribe {
  std::vector<std::uint32_t> subscriptions;
};
/// Well formed, but not offered here.
struct NotOffered {
  std::string what;
};

using ClientRequest = std::variant<Subscribe, Unsubscribe, NotOffered>;

/// Reads a message of a client. @return nothing if it is malformed
[[nodiscard]] std::optional<ClientRequest> parse_client(std::string_view message, bool binary);

}  // namespace tfdude::web::foxglove
