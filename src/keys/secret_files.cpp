#include "keys/secret_files.hpp"

#include <cerrno>
#include <cstdio>
#include <fcntl.h>
#include <filesystem>
#include <sys/file.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>
#include <utility>

#include "tfdude/base/id.hpp"

namespace tfdude::keys {
namespace {

constexpr mode_t kFileMode = 0600;
constexpr mode_t kDirectoryMode = 0700;

tl::unexpected<Error> failed(const std::string& path, const char* what, int error = errno) {
  return fail(Errc::kConfig, printable(path) + ": cannot be " + what + ": " +
                                 std::generic_category().message(error));
}

bool write_all(int descriptor, std::string_view content) {
  while (!content.empty()) {
    const ssize_t size = ::write(descriptor, content.data(), content.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) return false;
    content.remove_prefix(static_cast<std::size_t>(size));
  }
  return true;
}

// The owner can change the mode. Root can do everything.
Result<void> check_owner(const std::string& path, const struct stat& found) {
  constexpr uid_t kRoot = 0;
  if (found.st_uid == geteuid() || found.st_uid == kRoot) return {};
  return fail(Errc::kConfig, printable(path) + ": belongs to user " + std::to_string(found.st_uid) +
                                 ", who could change it: chown it to " + "user " +
                                 std::to_string(geteuid()));
}

// What was renamed is on the disk only when its directory is.
void sync_parent(const std::string& path) {
  const std::string parent = std::filesystem::path(path).parent_path();
  const int descriptor = ::open(parent.empty() ? "." : parent.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return;
  (void)fsync(descriptor);
  close(descriptor);
}

}  // namespace

Result<bool> make_directory(const std::string& path) {
  if (mkdir(path.c_str(), kDirectoryMode) == 0) return true;
  const int error = errno;
  std::error_code ignored;
  if (error == EEXIST && std::filesystem::is_directory(path, ignored)) return false;
  return failed(path, "created", error);
}

Result<void> write_secret(const std::string& path, std::string_view content) {
  const std::string beside = path + "." + std::to_string(getpid()) + ".tmp";
  const int out =
      ::open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, kFileMode);
  if (out < 0) return failed(beside, "created");
  const bool written = write_all(out, content) && fsync(out) == 0;
  const int error = errno;
  close(out);
  if (written && rename(beside.c_str(), path.c_str()) == 0)
    return sync_parent(path), Result<void>();
  const auto reason = failed(path, "written", written ? errno : error);
  unlink(beside.c_str());
  return reason;
}

Result<void> move_directory(const std::string& from, const std::string& to) {
  const bool replaces = access(to.c_str(), F_OK) == 0;
  if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(),
                replaces ? RENAME_EXCHANGE : RENAME_NOREPLACE) != 0) {
    return failed(to, "written");
  }
  sync_parent(to);
  return {};
}

Result<void> remove_directory(const std::string& path) {
  std::error_code error;
  std::filesystem::remove_all(path, error);
  if (error) return failed(path, "removed", error.value());
  return {};
}

Result<void> check_unchangeable(const std::string& path) {
  struct stat found {};
  if (stat(path.c_str(), &found) != 0) return failed(path, "read");
  if (auto ok = check_owner(path, found); !ok) return ok;
  if ((found.st_mode & (S_IWGRP | S_IWOTH)) == 0) return {};
  return fail(Errc::kConfig,
              printable(path) + ": others than its owner can change it: chmod go-w it");
}

Result<void> check_secret(const std::string& path) {
  struct stat found {};
  if (stat(path.c_str(), &found) != 0) return failed(path, "read");
  if (auto ok = check_owner(path, found); !ok) return ok;
  if ((found.st_mode & (S_IRWXG | S_IRWXO)) == 0) return {};
  char mode[8] = {};
  std::snprintf(mode, sizeof mode, "%04o", found.st_mode & 07777U);
  return fail(Errc::kConfig, printable(path) + ": others than its owner have access (mode " + mode +
                                 "): chmod 600 it, and replace the key if others may have read it");
}

Result<DirectoryLock> DirectoryLock::take(const std::string& directory) {
  const int descriptor = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return failed(directory, "opened");
  DirectoryLock lock(descriptor);
  while (flock(descriptor, LOCK_EX) != 0) {
    if (errno != EINTR) return failed(directory, "locked");
  }
  return lock;
}

DirectoryLock::~DirectoryLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

DirectoryLock::DirectoryLock(DirectoryLock&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)) {}

}  // namespace tfdude::keys
