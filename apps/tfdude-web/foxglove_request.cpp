#include "foxglove_request.hpp"

#include <cstring>

#include <nlohmann/json.hpp>

namespace tfdude::web::foxglove {
namespace {

using nlohmann::json;

std::optional<std::uint32_t> number_of(const json& value) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > UINT32_MAX) return std::nullopt;
  return value.get<std::uint32_t>();
}

std::optional<std::uint32_t> number_of(const json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return found == object.end() ? std::nullopt : number_of(*found);
}

const json* list_of(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_array() ? &*found : nullptr;
}

std::optional<std::uint32_t> length_at(std::string_view bytes, std::size_t place) {
  std::uint32_t length = 0;
  if (bytes.size() < place + sizeof(length)) return std::nullopt;
  std::memcpy(&length, bytes.data() + place, sizeof(length));
  return length;
}

// Whether the lengths that a binary message states fit what there is.
bool is_well_formed(std::string_view bytes) {
  if (bytes.empty()) return false;
  switch (bytes[0]) {
    case 1:  // a message: channel, data
      return bytes.size() >= 1 + 4;
    case 2: {  // a call: service, call, length of the encoding, encoding, data
      const auto length = length_at(bytes, 1 + 8);
      return length && *length <= bytes.size() - (1 + 12);
    }
    case 3: {  // playback: command, speed, whether to seek, time, length of the id, id
      const auto length = length_at(bytes, 1 + 14);
      return length && *length == bytes.size() - (1 + 18);
    }
    default:
      return false;
  }
}

std::optional<ClientRequest> subscribe(const json& message) {
  const json* list = list_of(message, "subscriptions");
  if (list == nullptr) return std::nullopt;
  Subscribe request;
  for (const json& one : *list) {
    const auto id = number_of(one, "id");
    const auto channel = number_of(one, "channelId");
    if (!id || !channel) return std::nullopt;
    request.subscriptions.emplace_back(*id, *channel);
  }
  return request;
}

std::optional<ClientRequest> unsubscribe(const json& message) {
  const json* list = list_of(message, "subscriptionIds");
  if (list == nullptr) return std::nullopt;
  Unsubscribe request;
  for (const json& one : *list) {
    const auto id = number_of(one);
    if (!id) return std::nullopt;
    request.subscriptions.push_back(*id);
  }
  return request;
}

}  // namespace

std::optional<ClientRequest> parse_client(std::string_view message, bool binary) {
  if (binary) {
    if (!is_well_formed(message)) return std::nullopt;
    return NotOffered{"messages of clients"};
  }
  const json parsed = json::parse(message, nullptr, false);
  if (!parsed.is_object()) return std::nullopt;
  const auto op = parsed.find("op");
  if (op == parsed.end() || !op->is_string()) return std::nullopt;
  if (*op == "subscribe") return subscribe(parsed);
  if (*op == "unsubscribe") return unsubscribe(parsed);
  constexpr std::size_t kShown = 40;
  return NotOffered{op->get<std::string>().substr(0, kShown)};
}

}  // namespace tfdude::web::foxglove
