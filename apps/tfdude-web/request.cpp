#include "request.hpp"

#include <charconv>

#include <nlohmann/json.hpp>

#include "tfdude/base/id.hpp"

namespace tfdude::web {
namespace {

constexpr std::size_t kMostText = 4096;  // [B]

std::optional<std::string> text_of(const nlohmann::json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_string()) return std::nullopt;
  return found->get<std::string>();
}

// Nanoseconds as decimal digits: a number of JavaScript has no 64 bits.
std::optional<Time> time_from(const std::string& digits) {
  std::int64_t ns = 0;
  const char* end = digits.data() + digits.size();
  const auto [read, error] = std::from_chars(digits.data(), end, ns);
  if (error != std::errc() || read != end || ns < 0) return std::nullopt;
  return time_of(ns);
}

}  // namespace

std::optional<PageRequest> parse_request(std::string_view text) {
  if (text.size() > kMostText) return std::nullopt;
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  const auto op = text_of(json, "op");
  if (op == "live") return LiveRequest{};
  if (op == "why") return WhyRequest{};
  if (op == "cancel") return CancelRequest{};
  if (op == "robot") return RobotRequest{};
  if (op == "upload") {
    const auto bytes = json.find("bytes");
    if (bytes == json.end() || !bytes->is_number_unsigned()) return std::nullopt;
    return UploadRequest{bytes->get<std::uint64_t>()};
  }
  if (op == "pair") {
    const auto a = text_of(json, "a");
    const auto b = text_of(json, "b");
    if (!a || !b || a->empty() != b->empty()) return std::nullopt;
    if (!a->empty() && !(check_id(*a, "a") && check_id(*b, "b"))) return std::nullopt;
    return PairRequest{*a, *b};
  }
  if (op == "past") {
    const auto digits = text_of(json, "at");
    const auto at = digits ? time_from(*digits) : std::nullopt;
    if (at) return PastRequest{*at};
  }
  return std::nullopt;
}

}  // namespace tfdude::web
