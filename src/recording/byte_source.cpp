#include "recording/byte_source.hpp"

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

#include "tfdude/base/id.hpp"

namespace tfdude::recording {
namespace {

std::string reason() { return std::generic_category().message(errno); }

class FileSource final : public ByteSource {
 public:
  FileSource(std::string file, int fd, std::uint64_t size)
      : file_(std::move(file)), fd_(fd), size_(size) {}
  ~FileSource() override { close(fd_); }
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;

  [[nodiscard]] std::uint64_t size() const override { return size_; }

  [[nodiscard]] Result<void> read(std::uint64_t offset, std::size_t count,
                                  std::string& out) const override {
    if (offset > size_ || count > size_ - offset) {
      return fail(Errc::kConfig, quote(file_) + " ends before byte " + std::to_string(offset) +
                                     " and " + std::to_string(count) + " more");
    }
    out.resize(count);
    std::size_t done = 0;
    while (done < count) {
      const ssize_t got =
          pread(fd_, out.data() + done, count - done, static_cast<off_t>(offset + done));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) return fail(Errc::kConfig, "cannot read " + quote(file_) + ": " + reason());
      if (got == 0) return fail(Errc::kConfig, quote(file_) + " has become shorter");
      done += static_cast<std::size_t>(got);
    }
    return {};
  }

 private:
  std::string file_;
  int fd_;
  std::uint64_t size_;
};

}  // namespace

Result<std::unique_ptr<ByteSource>> open_source(const std::string& file) {
  // A pipe that nobody writes to would wait here otherwise.
  const int fd = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) return fail(Errc::kConfig, "cannot open " + quote(file) + ": " + reason());
  struct stat info {};
  if (fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) {
    close(fd);
    return fail(Errc::kConfig, quote(file) + " is not a file");
  }
  return std::make_unique<FileSource>(file, fd, static_cast<std::uint64_t>(info.st_size));
}

Result<void> TextSource::read(std::uint64_t offset, std::size_t count, std::string& out) const {
  if (offset > bytes_.size() || count > bytes_.size() - offset) {
    return fail(Errc::kConfig, "it ends before byte " + std::to_string(offset));
  }
  out.assign(bytes_, static_cast<std::size_t>(offset), count);
  return {};
}

Result<std::string_view> SourceWindow::at(std::uint64_t offset, std::size_t count) {
  const bool inside = offset >= begin_ && offset - begin_ <= bytes_.size() &&
                      count <= bytes_.size() - (offset - begin_);
  if (!inside) {
    const std::uint64_t left = source_.size() - std::min(offset, source_.size());
    const auto ahead = static_cast<std::size_t>(std::min<std::uint64_t>(left, kAhead));
    if (auto ok = source_.read(offset, std::max(count, ahead), bytes_); !ok) {
      bytes_.clear();
      return tl::unexpected(std::move(ok.error()));
    }
    begin_ = offset;
  }
  return std::string_view(bytes_).substr(static_cast<std::size_t>(offset - begin_), count);
}

}  // namespace tfdude::recording
