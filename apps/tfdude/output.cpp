#include "output.hpp"

#include <cerrno>
#include <cstdlib>
#include <fcntl.h>
#include <memory>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

#include "tfdude/base/id.hpp"

#include "program.hpp"

namespace tfdude::cli {
namespace {

tl::unexpected<Error> failed(const std::string& file) {
  return fail(Errc::kInvalidInput,
              "cannot write " + quote(file) + ": " + std::generic_category().message(errno));
}

bool is_open_as(int descriptor, const struct stat& found) {
  struct stat open {};
  return fstat(descriptor, &open) == 0 && open.st_dev == found.st_dev &&
         open.st_ino == found.st_ino;
}

Result<void> write_to(int descriptor, const std::string& file, const std::string& bytes) {
  const Descriptor out(descriptor);
  if (out.get() < 0 || !out.write_all(bytes)) return failed(file);
  return {};
}

// @param before  the regular file that is there; null: none
Result<void> replace(const std::string& file, const struct stat* before, const std::string& bytes) {
  const std::string beside = file + "." + std::to_string(getpid()) + ".tmp";
  // Nobody reads in between what they may not read later.
  const mode_t mode = before != nullptr ? 0600 : 0666;
  const Descriptor out(open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode));
  if (out.get() < 0) return failed(file);
  bool done = true;
  if (before != nullptr) {
    // Only root can give it back to another user.
    (void)!fchown(out.get(), before->st_uid, before->st_gid);
    done = fchmod(out.get(), before->st_mode & 0777U) == 0;
  }
  if (done && out.write_all(bytes) && rename(beside.c_str(), file.c_str()) == 0) return {};
  const auto error = failed(file);
  unlink(beside.c_str());
  return error;
}

}  // namespace

bool is_standard_output(const std::string& file) {
  struct stat found {};
  return stat(file.c_str(), &found) == 0 && is_open_as(STDOUT_FILENO, found);
}

Result<void> write_file(const std::string& file, const std::string& bytes) {
  struct stat found {};
  if (stat(file.c_str(), &found) != 0) {
    if (lstat(file.c_str(), &found) != 0 || !S_ISLNK(found.st_mode)) {
      return replace(file, nullptr, bytes);
    }
    // A link to what is not there yet.
    constexpr mode_t kMode = 0666;
    return write_to(open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, kMode), file, bytes);
  }
  // Behind what was written there: others, as a shell, have the same open file.
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) {
    if (is_open_as(stream, found)) return write_to(dup(stream), file, bytes);
  }
  if (!S_ISREG(found.st_mode)) {
    return write_to(open(file.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY), file, bytes);
  }
  const std::unique_ptr<char, decltype(&std::free)> target(realpath(file.c_str(), nullptr),
                                                           &std::free);
  return target != nullptr ? replace(target.get(), &found, bytes) : failed(file);
}

}  // namespace tfdude::cli
