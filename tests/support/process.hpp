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

/// By when anything that works has happened, even where the machine is busy with something else.
[[nodiscard]] inline Deadline in_time() { return Clock::now() + std::chrono::seconds(30); }

/// A process of its own, whose output is kept. Killed and reaped with the object; the kernel kills
/// it where the test itself is killed, since no destructor runs then. Belongs to one thread, which
/// has to outlive it.
class Process {
 public:
  /// Starts argv[0], a path.
  /// @param network  a namespace of the kernel to start it in, as an open file; -1: this thread's
  /// @throws std::system_error where there can be no new process.
  explicit Process(const std::vector<std::string>& argv, int network = -1);
  ~Process();
  Process(Process&& other) noexcept;
  Process& operator=(Process&&) = delete;

  [[nodiscard]] pid_t pid() const { return pid_; }

  /// Of standard output, the first line with this beginning; nothing where the output ends without
  /// it or the deadline passes.
  [[nodiscard]] std::optional<std::string> wait_for_line(const std::string& prefix,
                                                         Deadline deadline);

  /// The exit status, or 128 and the signal's number as in a shell; nothing where it still runs at
  /// the deadline.
  [[nodiscard]] std::optional<int> wait(Deadline deadline);

  [[nodiscard]] bool runs() { return !wait(Clock::now()); }

  void signal(int number) const;

  /// Kills it, and waits until it is no more.
  void kill();
  /// Stops it as a debugger does, and waits until it stands still; SIGCONT lets it go on.
  void freeze() const;

  /// What was written until the last wait.
  [[nodiscard]] const std::string& out() const { return streams_[0].text; }
  [[nodiscard]] const std::string& err() const { return streams_[1].text; }

 private:
  struct Stream {
    int fd = -1;
    std::string text;
  };

  /// Takes what was written, or waits a moment for that.
  void read_some(Deadline deadline);
  [[nodiscard]] bool ended() const { return streams_[0].fd < 0 && streams_[1].fd < 0; }
  bool reap();

  pid_t pid_ = -1;
  std::optional<int> status_;
  std::array<Stream, 2> streams_;  // standard output and error
};

/// A directory for generated files, gone with the object.
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

/// Tries again and again until it holds. @return false where it does not within a deadline
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
