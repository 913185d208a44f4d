#include "transport/fastdds/announcement.hpp"

#include <locale>
#include <sstream>

#include "tfdude/base/id.hpp"

namespace tfdude::fastdds {
namespace {

constexpr const char* kServer = "tfdude serving ";
constexpr const char* kClient = "tfdude client";
constexpr const char* kVersion = "tfdude-protocol";
constexpr const char* kKeys = "keys";

}  // namespace

std::string participant_name(const std::string& partition) {
  return partition.empty() ? kClient : kServer + partition;
}

std::vector<std::uint8_t> user_data(const std::string& authority) {
  std::string text = std::string(kVersion) + " " + std::to_string(kProtocolVersion.major) + " " +
                     std::to_string(kProtocolVersion.minor) + " " + program_version();
  if (!authority.empty()) text += std::string(" ") + kKeys + " " + authority;
  return {text.begin(), text.end()};
}

Announcement read_announcement(const std::string& name, const std::vector<std::uint8_t>& data) {
  const bool serves = name.rfind(kServer, 0) == 0;
  Announcement said;
  if (!serves && name != kClient) return said;
  said.is_ours = true;
  if (serves) said.partition = printable(name.substr(std::string(kServer).size()));
  std::istringstream text(std::string(data.begin(), data.end()));
  text.imbue(std::locale::classic());
  std::string word;
  ProtocolVersion protocol;
  const bool has_version =
      text >> word && word == kVersion && text >> protocol.major >> protocol.minor;
  said.protocol = has_version ? protocol : ProtocolVersion{};
  if (has_version && text >> word) said.program = printable(word);
  if (has_version && text >> word && word == kKeys && text >> word) {
    said.authority = printable(word);
  }
  return said;
}

}  // namespace tfdude::fastdds
