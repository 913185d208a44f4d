#include "identity.hpp"

#include <charconv>

namespace tfdude::ros {
namespace {

// "enclave=/;tfdude-bridge=PID,HOST,PARTITION;". Neither a host's name nor a partition's has a
// comma, but a partition's may have a semicolon, so it comes last.
constexpr std::string_view kBegin = "enclave=/;tfdude-bridge=";

template <class Octets>
void append_hex(const Octets& octets, std::size_t count, std::string& out) {
  constexpr const char* kDigits = "0123456789abcdef";
  for (std::size_t i = 0; i < count; ++i) {
    if (!out.empty()) out += '.';
    out += kDigits[octets[i] >> 4U];
    out += kDigits[octets[i] & 15U];
  }
}

}  // namespace

std::string text_of(const fastdds::ertps::GUID_t& guid) {
  std::string text;
  append_hex(guid.guidPrefix.value, fastdds::ertps::GuidPrefix_t::size, text);
  append_hex(guid.entityId.value, fastdds::ertps::EntityId_t::size, text);
  return text;
}

std::vector<std::uint8_t> user_data_of(const BridgeMark& mark) {
  const std::string text =
      std::string(kBegin) + std::to_string(mark.pid) + ',' + mark.host + ',' + mark.partition + ';';
  return {text.begin(), text.end()};
}

std::optional<BridgeMark> mark_of(const std::vector<std::uint8_t>& user_data) {
  std::string_view text;
  if (!user_data.empty()) {
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): bytes as characters
    text = {reinterpret_cast<const char*>(user_data.data()), user_data.size()};
  }
  if (text.substr(0, kBegin.size()) != kBegin || text.back() != ';') return std::nullopt;
  text = text.substr(kBegin.size(), text.size() - kBegin.size() - 1);
  const std::size_t host = text.find(',');
  const std::size_t partition = host == std::string_view::npos ? host : text.find(',', host + 1);
  if (partition == std::string_view::npos) return std::nullopt;
  BridgeMark mark;
  const auto pid = std::from_chars(text.data(), text.data() + host, mark.pid);
  if (pid.ec != std::errc() || pid.ptr != text.data() + host) return std::nullopt;
  mark.host = text.substr(host + 1, partition - host - 1);
  mark.partition = text.substr(partition + 1);
  return mark;
}

}  // namespace tfdude::ros
