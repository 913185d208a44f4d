#pragma once

#include <string>
#include <string_view>

#include "tfdude/base/result.hpp"

// Files and directories that only their owner may read. Failures are kConfig naming the path.
namespace tfdude::keys {

/// Creates a directory that only its owner may enter. @return whether it did not exist yet
[[nodiscard]] Result<bool> make_directory(const std::string& path);

/// Writes a file under another name and renames it, so it is complete or does not change.
[[nodiscard]] Result<void> write_secret(const std::string& path, std::string_view content);

/// Moves a directory to a path. If there is one already, it takes the place of the first one.
[[nodiscard]] Result<void> move_directory(const std::string& from, const std::string& to);

[[nodiscard]] Result<void> remove_directory(const std::string& path);

/// Fails if others than this user, and root, can change or replace the file or directory: it
/// belongs to another user, or its group or everybody may write to it.
[[nodiscard]] Result<void> check_unchangeable(const std::string& path);

/// Fails if others than the owner can read or write the file.
[[nodiscard]] Result<void> check_secret(const std::string& path);

/// Keeps out other processes that lock the same directory, while it exists.
class DirectoryLock {
 public:
  [[nodiscard]] static Result<DirectoryLock> take(const std::string& directory);
  ~DirectoryLock();
  DirectoryLock(DirectoryLock&& other) noexcept;
  DirectoryLock& operator=(DirectoryLock&&) = delete;

 private:
  explicit DirectoryLock(int descriptor) : descriptor_(descriptor) {}

  int descriptor_;
};

}  // namespace tfdude::keys
