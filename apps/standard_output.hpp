#pragma once

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <string>
#include <unistd.h>

#include "exit_status.hpp"

// What becomes of a program whose standard output cannot be written, on a full disk for example.
namespace tfdude::cli {

/// Writes what was printed.
/// @return why that was not possible, for all that was printed so far; empty: it was
[[nodiscard]] inline const std::string& flush_output() {
  static std::string why;
  errno = 0;
  const bool failed = std::fflush(stdout) != 0 || std::ferror(stdout) != 0;
  // What was written before may have failed, for a reason that is not known any more.
  if (failed && why.empty()) why = errno != 0 ? std::strerror(errno) : "cannot be written";
  return why;
}

/// The same in a program that prints until it is interrupted: there is no use in going on, so it
/// ends as if it was.
inline void flush_or_end() {
  static bool ended = false;
  if (flush_output().empty() || ended) return;
  sigset_t blocked;
  const bool until_interrupted =
      pthread_sigmask(SIG_BLOCK, nullptr, &blocked) == 0 && sigismember(&blocked, SIGTERM) == 1;
  if (!until_interrupted) return;
  ended = true;
  (void)kill(getpid(), SIGTERM);
}

/// The exit status of a program that has printed all: says so if not all of it was written.
[[nodiscard]] inline int status_with_output(const std::string& program, int status) {
  const std::string& why = flush_output();
  if (why.empty()) return status;
  std::fprintf(stderr, "%s: standard output: %s\n", program.c_str(), why.c_str());
  return status == kDone ? kRejected : status;
}

}  // namespace tfdude::cli
