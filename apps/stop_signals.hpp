#pragma once

#include <csignal>

namespace tfdude::cli {

/// The signals that stop a program that runs until then.
[[nodiscard]] inline sigset_t stop_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  return signals;
}

/// Blocks these signals. Call it before any thread starts: all threads inherit this, so
/// sigwait() gets the signals.
inline sigset_t block_stop_signals() {
  const sigset_t signals = stop_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

}  // namespace tfdude::cli
