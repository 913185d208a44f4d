#include "support/process.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <poll.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace tfdude::testing {
namespace {

using std::chrono::milliseconds;

constexpr int kExecFailed = 127;

// How long to wait for output before checking anything else.
constexpr milliseconds kLook{5};

[[noreturn]] void fail_with_errno(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

std::array<int, 2> make_pipe() {
  std::array<int, 2> ends{};
  // Closed in all children that are started meanwhile, so that an end of file is one.
  if (pipe2(ends.data(), O_CLOEXEC) != 0) fail_with_errno("pipe2");
  return ends;
}

// Between fork and exec: only what is safe in a signal handler, as other threads' locks stay
// locked.
[[noreturn]] void become(char* const* argv, pid_t parent, int network, int out, int err) {
  if (network >= 0 && setns(network, CLONE_NEWNET) != 0) _exit(kExecFailed);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kExecFailed);
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  execv(argv[0], argv);
  _exit(kExecFailed);
}

}  // namespace

Process::Process(const std::vector<std::string>& argv, int network) {
  std::vector<char*> arguments;
  for (const std::string& argument : argv) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  const auto out = make_pipe();
  const auto err = make_pipe();
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) become(arguments.data(), parent, network, out[1], err[1]);
  close(out[1]);
  close(err[1]);
  streams_[0].fd = out[0];
  streams_[1].fd = err[0];
  if (pid_ < 0) fail_with_errno("fork");
}

Process::Process(Process&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      status_(other.status_),
      streams_(std::exchange(other.streams_, {})) {}

Process::~Process() {
  for (const Stream& stream : streams_) {
    if (stream.fd >= 0) close(stream.fd);
  }
  if (pid_ < 0 || status_) return;
  kill();
}

void Process::read_some(Deadline deadline) {
  std::array<pollfd, 2> polled{};
  for (std::size_t i = 0; i < 2; ++i) polled[i] = {streams_[i].fd, POLLIN, 0};
  const auto left = std::chrono::duration_cast<milliseconds>(deadline - Clock::now());
  const auto pause = std::clamp(left, milliseconds(0), kLook);
  if (poll(polled.data(), polled.size(), static_cast<int>(pause.count())) <= 0) return;
  for (std::size_t i = 0; i < 2; ++i) {
    if (polled[i].revents == 0) continue;
    std::array<char, 4096> block;
    const ssize_t count = read(streams_[i].fd, block.data(), block.size());
    if (count > 0) {
      streams_[i].text.append(block.data(), static_cast<std::size_t>(count));
    } else if (count == 0 || errno != EINTR) {
      close(std::exchange(streams_[i].fd, -1));
    }
  }
}

std::optional<std::string> Process::wait_for_line(const std::string& prefix, Deadline deadline) {
  while (true) {
    const std::string& text = streams_[0].text;
    for (std::size_t begin = 0, end = 0; (end = text.find('\n', begin)) != std::string::npos;
         begin = end + 1) {
      if (text.compare(begin, prefix.size(), prefix) == 0) return text.substr(begin, end - begin);
    }
    if (streams_[0].fd < 0 || Clock::now() > deadline) return std::nullopt;
    read_some(deadline);
  }
}

bool Process::reap() {
  int status = 0;
  if (!status_ && waitpid(pid_, &status, WNOHANG) == pid_) {
    status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  return status_.has_value();
}

std::optional<int> Process::wait(Deadline deadline) {
  do {
    read_some(deadline);
    // Reads the streams to their end first, because all output belongs to the result.
    if (ended() && reap()) return status_;
  } while (Clock::now() <= deadline);
  return std::nullopt;
}

void Process::signal(int number) const {
  if (!status_) ::kill(pid_, number);
}

void Process::kill() {
  signal(SIGKILL);
  int status = 0;
  if (!status_ && waitpid(pid_, &status, 0) == pid_) status_ = 128 + SIGKILL;
}

void Process::freeze() const {
  signal(SIGSTOP);
  siginfo_t info{};
  // If the process has ended instead, wait() handles that.
  waitid(P_PID, static_cast<id_t>(pid_), &info, WSTOPPED | WEXITED | WNOWAIT);
}

std::string maps_of(pid_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/maps");
  return {std::istreambuf_iterator<char>(file), {}};
}

TemporaryDirectory::TemporaryDirectory() {
  path_ = (std::filesystem::temp_directory_path() / "tfdude-test-XXXXXX").string();
  if (mkdtemp(path_.data()) == nullptr) fail_with_errno("mkdtemp");
}

TemporaryDirectory::~TemporaryDirectory() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::string TemporaryDirectory::write(const std::string& name, const std::string& text) const {
  std::string path = path_ + "/" + name;
  std::ofstream(path, std::ios::binary) << text;
  return path;
}

}  // namespace tfdude::testing
