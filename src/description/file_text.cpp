#include "description/file_text.hpp"

#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

#include "tfdude/base/id.hpp"

namespace tfdude {

Result<std::string> read_text(const std::string& path) {
  const std::string name = printable(path);
  constexpr std::size_t kMaxBytes = std::size_t{64} << 20U;
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    return fail(Errc::kConfig, name + ": is a directory");
  }
  const auto reason = [] { return std::generic_category().message(errno); };
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) return fail(Errc::kConfig, name + ": cannot be opened: " + reason());
  std::string text;
  std::array<char, 65536> block{};
  while (file) {
    file.read(block.data(), block.size());
    text.append(block.data(), static_cast<std::size_t>(file.gcount()));
    if (text.size() > kMaxBytes) return fail(Errc::kConfig, name + ": is longer than 64 MiB");
  }
  if (file.bad()) return fail(Errc::kConfig, name + ": cannot be read: " + reason());
  // The byte order mark that some editors write.
  constexpr std::string_view kMark = "\xef\xbb\xbf";
  if (text.rfind(kMark, 0) == 0) text.erase(0, kMark.size());
  return text;
}

tl::unexpected<Error> file_error(Errc code, const std::string& file, int line,
                                 const std::string& message) {
  const std::string place = line > 0 ? ":" + std::to_string(line) : "";
  return fail(code, file + place + ": " + printable(message));
}

}  // namespace tfdude
