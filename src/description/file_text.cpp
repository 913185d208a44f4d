#include "description/file_text.hpp"

#include <array>
#include <cerrno>
#include <fcntl.h>
#include <string_view>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

#include "tfdude/base/id.hpp"

namespace tfdude {

namespace {

struct Opened {
  explicit Opened(int number) : fd(number) {}
  Opened(const Opened&) = delete;
  Opened& operator=(const Opened&) = delete;
  ~Opened() {
    if (fd >= 0) ::close(fd);
  }
  const int fd;
};

}  // namespace

Result<std::string> read_text(const std::string& path, Readable readable) {
  const std::string name = printable(path);
  constexpr std::size_t kMaxBytes = std::size_t{64} << 20U;
  const auto reason = [] { return std::generic_category().message(errno); };
  const bool regular = readable == Readable::kRegularFile;
  const Opened file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | (regular ? O_NONBLOCK : 0)));
  if (file.fd < 0) return fail(Errc::kConfig, name + ": cannot be opened: " + reason());
  struct stat info {};
  if (::fstat(file.fd, &info) != 0) {
    return fail(Errc::kConfig, name + ": cannot be read: " + reason());
  }
  if (S_ISDIR(info.st_mode)) return fail(Errc::kConfig, name + ": is a directory");
  if (regular && !S_ISREG(info.st_mode)) {
    return fail(Errc::kConfig, name + ": is not a regular file");
  }
  std::string text;
  std::array<char, 65536> block{};
  for (ssize_t size = 1; size != 0;) {
    size = ::read(file.fd, block.data(), block.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) return fail(Errc::kConfig, name + ": cannot be read: " + reason());
    text.append(block.data(), static_cast<std::size_t>(size));
    if (text.size() > kMaxBytes) return fail(Errc::kConfig, name + ": is longer than 64 MiB");
  }
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
