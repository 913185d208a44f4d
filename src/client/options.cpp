#include "tfdude/types/options.hpp"

#include <cctype>
#include <charconv>
#include <cstdlib>
#include <string>
#include <string_view>

namespace tfdude {
namespace {

std::string_view environment(const char* name) {
  const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nothing sets it
  return value != nullptr ? value : "";
}

}  // namespace

std::uint32_t domain_of_environment() {
  const std::string_view text = environment("TFDUDE_DOMAIN");
  if (text.empty()) return 0;
  std::uint32_t domain = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), domain);
  return read.ec == std::errc() && read.ptr == text.data() + text.size() ? domain : kNoDomain;
}

std::string profile_of_environment() { return std::string(environment("TFDUDE_PROFILE")); }

bool shared_memory_of_environment() {
  std::string text(environment("TFDUDE_SHARED_MEMORY"));
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text != "off" && text != "false" && text != "no" && text != "0";
}

std::string keys_of_environment() { return std::string(environment("TFDUDE_KEYS")); }

}  // namespace tfdude
