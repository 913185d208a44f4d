#include "program.hpp"

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <optional>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <system_error>
#include <thread>
#include <unistd.h>

#include "tfdude/base/id.hpp"

namespace tfdude::cli {
namespace {

// Long enough for Graphviz to lay out some thousand frames.
constexpr std::chrono::seconds kProgramTimeout{120};

std::string reason() { return std::generic_category().message(errno); }

// The status of a process as waitpid() returns it; none if it took too long and was killed.
std::optional<int> wait_for(pid_t pid) {
  const auto deadline = std::chrono::steady_clock::now() + kProgramTimeout;
  int status = 0;
  while (waitpid(pid, &status, WNOHANG) == 0) {
    if (std::chrono::steady_clock::now() > deadline) {
      kill(pid, SIGKILL);
      (void)waitpid(pid, &status, 0);
      return std::nullopt;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return status;
}

}  // namespace

Descriptor::~Descriptor() {
  if (fd_ >= 0) close(fd_);
}

bool Descriptor::write_all(const std::string& text) const {
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t count = write(fd_, text.data() + done, text.size() - done);
    if (count < 0 && errno != EINTR) return false;
    if (count > 0) done += static_cast<std::size_t>(count);
  }
  return true;
}

std::string Descriptor::read_all() const {
  std::string text;
  std::array<char, 65536> block{};
  for (ssize_t count = 0;
       (count = pread(fd_, block.data(), block.size(), static_cast<off_t>(text.size()))) > 0;) {
    text.append(block.data(), static_cast<std::size_t>(count));
  }
  return text;
}

Result<std::string> run_program(Program program, const std::string& input) {
  const Descriptor in(memfd_create("in", MFD_CLOEXEC));
  const Descriptor out(memfd_create("out", MFD_CLOEXEC));
  const Descriptor err(memfd_create("err", MFD_CLOEXEC));
  if (in.get() < 0 || out.get() < 0 || err.get() < 0 || !in.write_all(input) ||
      lseek(in.get(), 0, SEEK_SET) != 0) {
    return fail(Errc::kInvalidInput, "no memory for its files: " + reason());
  }
  std::vector<char*> argv;
  for (std::string& word : program.argv) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in.get(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, out.get(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err.get(), STDERR_FILENO);
  posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);  // closes DDS's sockets
  pid_t pid = 0;
  const int failed = posix_spawnp(&pid, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) {
    return fail(Errc::kInvalidInput, "cannot run " + quote(program.argv[0]) + " of the package " +
                                         program.package + ": " +
                                         std::generic_category().message(failed));
  }
  const auto status = wait_for(pid);
  if (!status) return fail(Errc::kInvalidInput, quote(program.argv[0]) + " does not end");
  if (*status != 0) {
    return fail(Errc::kInvalidInput,
                quote(program.argv[0]) + " failed: " + printable(err.read_all().substr(0, 1000)));
  }
  return out.read_all();
}

}  // namespace tfdude::cli
