#include "store/sqlite_store.hpp"

namespace tfdude {
namespace {

constexpr std::size_t kLongestFileName = 200;

}  // namespace

std::string state_file(const std::string& directory, std::uint32_t domain,
                       const std::string& partition) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string name;
  std::uint32_t hash = 2166136261U;
  for (const char c : partition) {
    const auto byte = static_cast<unsigned char>(c);
    hash = (hash ^ byte) * 16777619U;
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '-' || c == '_' || (c == '.' && !name.empty());
    if (plain) {
      name += c;
    } else {
      name += {'%', kDigits[byte >> 4U], kDigits[byte & 15U]};
    }
  }
  if (name.size() > kLongestFileName) {
    name = name.substr(0, kLongestFileName) + "-" + std::to_string(hash);
  }
  return directory + "/domain-" + std::to_string(domain) + "/" + name + ".sqlite";
}

}  // namespace tfdude
