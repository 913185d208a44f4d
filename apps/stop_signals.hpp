#pragma once

#include <csignal>

namespace tfdude::cli {

/// The signals that stop a program that runs until then; SIGHUP, by which a terminal ends, unless
/// the program is to survive that (nohup).
[[nodiscard]] inline sigset_t stop_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  struct sigaction hangup {};
  const bool ignored = sigaction(SIGHUP, nullptr, &hangup) == 0 && hangup.sa_handler == SIG_IGN;
  if (!ignored) sigaddset(&signals, SIGHUP);
  return signals;
}

/// Blocks these signals. Call it before any thread starts: all threads inherit this, so
/// sigwait() gets the signals.
inline sigset_t block_stop_signals() {
  const sigset_t signals = stop_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

/// While it exists, these signals end the process at once: there is nothing to stop in order while
/// files are read, and a file may be slow, or a pipe that nobody writes to. Start no thread
/// meanwhile.
class EndAtSignals {
 public:
  EndAtSignals() : signals_(stop_signals()) { pthread_sigmask(SIG_UNBLOCK, &signals_, nullptr); }
  ~EndAtSignals() { pthread_sigmask(SIG_BLOCK, &signals_, nullptr); }
  EndAtSignals(const EndAtSignals&) = delete;
  EndAtSignals& operator=(const EndAtSignals&) = delete;

 private:
  sigset_t signals_;
};

}  // namespace tfdude::cli
