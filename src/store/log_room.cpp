#include "store/log_room.hpp"

#include <cerrno>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace tfdude {
namespace {

std::int64_t size_of(const std::string& file) {
  struct stat found {};
  return ::stat(file.c_str(), &found) == 0 ? static_cast<std::int64_t>(found.st_size) : 0;
}

}  // namespace

bool LogRoom::is_inside() const { return size_of(log_) >= kBytes; }

// Twice what is needed, so that most calls find it there.
bool LogRoom::reserve() {
  const std::int64_t size = size_of(log_);
  if (size + kBytes <= reserved_) return true;
  const int file = ::open(log_.c_str(), O_WRONLY | O_CLOEXEC | O_NOFOLLOW);
  if (file < 0) return true;
  const auto take = [&](std::int64_t bytes) {
    if (::fallocate(file, FALLOC_FL_KEEP_SIZE, size, bytes) != 0) return false;
    reserved_ = size + bytes;
    return true;
  };
  const bool full =
      !take(2 * kBytes) && !take(kBytes) && (errno == ENOSPC || errno == EDQUOT || errno == EFBIG);
  ::close(file);
  return !full;
}

}  // namespace tfdude
