#pragma once

#include <array>
#include <chrono>
#include <optional>
#include <string>
#include <sys/types.h>
#include <thread>
#include <vector>

namespace tfdude::testing {

using Clock = std::chrono::steady_clock;
using Deadline = Clock::time_point;

/// A time limit that working code meets even on a busy machine.
[[nodiscard]] inline Deadline in_time() { return Clock::now() + std::chrono::seconds(30); }

/// A child process whose output is kept. The destructor kills and reaps it. If the test itself is
/// killed, no destructor runs, and the kernel kills the process. Belongs to one thread, which must
/// outlive it.
class Process {
 public:
  /// Starts argv[0], a path.
  /// @param network  a namespace of the kernel to start it in, as an open file; -1: this thread's
  /// @throws std::system_error if no process can be created.
  explicit Process(const std::vector<std::string>& argv, int network = -1);
  ~Process();
  Process(Process&& other) noexcept;
  Process& operator=(Process&&) = delete;

  [[nodiscard]] pid_t pid() const { return pid_; }

  /// The first line of standard output with this prefix; none if the output ends without it, or at
  /// the deadline.
  [[nodiscard]] std::optional<std::string> wait_for_line(const std::string& prefix,
                                                         Deadline deadline);

  /// The exit status, or 128 plus the signal's number as in a shell; none if it still runs at the
  /// deadline.
  [[nodiscard]] std::optional<int> wait(Deadline deadline);

  [[nodiscard]] bool runs() { return !wait(Clock::now()); }

  void signal(int number) const;

  /// Kills it, and waits for its end.
  void kill();
  /// Stops it as a debugger does, and waits until it has stopped; SIGCONT continues it.
  void freeze() const;

  /// The output until the last wait.
  [[nodiscard]] const std::string& out() const { return streams_[0].text; }
  [[nodiscard]] const std::string& err() const { return streams_[1].text; }

 private:
  struct Stream {
    int fd = -1;
    std::string text;
  };

  /// Reads the output, or waits a moment for it.
  void read_some(Deadline deadline);
  [[nodiscard]] bool ended() const { return streams_[0].fd < 0 && streams_[1].fd < 0; }
  bool reap();

  pid_t pid_ = -1;
  std::optional<int> status_;
  std::array<Stream, 2> streams_;  // standard output and error
};

/// Whatever a process has mapped into its memory, line by line.
[[nodiscard]] std::string maps_of(pid_t process);

/// A directory for generated files; the destructor removes it.
class TemporaryDirectory {
 public:
  TemporaryDirectory();
  ~TemporaryDirectory();
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;

  [[nodiscard]] const std::string& path() const { return path_; }

  /// Writes a file. @return its path
  [[nodiscard]] std::string write(const std::string& name, const std::string& text) const;

 private:
  std::string path_;
};

/// Repeats until the condition is true. @return false if it is not within a deadline
template <class Condition>
[[nodiscard]] bool eventually(Condition condition) {
  const Deadline deadline = in_time();
  while (!condition()) {
    if (Clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

}  // namespace tfdude::testing
