#include "recording/output_file.hpp"

#include <cerrno>
#include <fcntl.h>
#include <system_error>
#include <unistd.h>

#include "tfdude/base/id.hpp"

namespace tfdude::recording {
namespace {

tl::unexpected<Error> failed(const std::string& name, int reason) {
  return fail(reason == EEXIST ? Errc::kAlreadyExists : Errc::kInvalidInput,
              "cannot write " + quote(name) + ": " + std::generic_category().message(reason));
}

}  // namespace

Result<std::unique_ptr<OutputFile>> OutputFile::create(const std::string& name) {
  const int fd = open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (fd < 0) return failed(name, errno);
  return std::unique_ptr<OutputFile>(new OutputFile(name, fd));
}

OutputFile::~OutputFile() { close(fd_); }

Result<void> OutputFile::write(std::string_view bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = ::write(fd_, bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const auto error = failed(name_, errno);
      // If even this fails, readers find the last record cut.
      if (ftruncate(fd_, static_cast<off_t>(size_)) == 0) lseek(fd_, 0, SEEK_END);
      return error;
    }
    done += static_cast<std::size_t>(count);
  }
  size_ += bytes.size();
  return {};
}

}  // namespace tfdude::recording
