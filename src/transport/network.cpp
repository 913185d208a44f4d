#include "transport/network.hpp"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "tfdude/types/options.hpp"

#include "description/file_text.hpp"

namespace tfdude {
namespace {

// Fowler, Noll and Vo's hash. Not against somebody who looks for a collision: whoever may listen at
// the socket of this name is of the same user.
std::uint64_t hash_of(std::string_view text) {
  std::uint64_t hash = 0xCBF2'9CE4'8422'2325;
  for (const char one : text) {
    hash = (hash ^ static_cast<unsigned char>(one)) * 0x0000'0100'0000'01B3;
  }
  return hash;
}

}  // namespace

std::string network_of(std::uint32_t domain, const std::string& profile) {
  std::string profiles = profile;
  if (!profile.empty() && profile != kLocalProfile) {
    auto text = read_text(profile, Readable::kRegularFile);
    if (!text) return {};
    profiles = *std::move(text);
  }
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nothing sets variables
  const char* server = std::getenv("ROS_DISCOVERY_SERVER");
  std::string all = std::to_string(domain);
  for (const char* more : {profiles.c_str(), server != nullptr ? server : ""}) {
    all += '\n';
    all += more;
  }
  std::array<char, 17> text{};
  (void)std::snprintf(text.data(), text.size(), "%016llx",
                      static_cast<unsigned long long>(hash_of(all)));
  return text.data();
}

}  // namespace tfdude
