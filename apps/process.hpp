#pragma once

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <string_view>
#include <system_error>
#include <thread>
#include <unistd.h>
#include <utility>

#include <spdlog/async.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "tfdude/base/id.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/transport/fastdds.hpp"

#include "bounded_log.hpp"
#include "exit_status.hpp"
#include "service_manager.hpp"
#include "stop_signals.hpp"

// What the programs that serve a partition have in common as processes.
namespace tfdude::cli {

/// Logs go to standard error, those of the library, too, which uses the logger of this name. If
/// nobody reads the log, lines are lost rather than delaying the program. The journal gets
/// the level instead of the time and the name, which it knows.
inline void log_to_standard_error() {
  // Each line is one write, colours and all: what others write to the terminal stays outside it.
  (void)std::setvbuf(stderr, nullptr, _IOLBF, BUFSIZ);
  spdlog::set_default_logger(spdlog::create_async_nb<BoundedSink>(
      "tfdude", std::make_shared<spdlog::sinks::stderr_color_sink_mt>()));
  if (is_journal(STDERR_FILENO)) {
    auto formatter = std::make_unique<spdlog::pattern_formatter>();
    formatter->add_flag<JournalLevel>('*').set_pattern("<%*>%v");
    spdlog::set_formatter(std::move(formatter));
  }
  log_fastdds_to_standard_error();
}

/// From now on the process ends within this time, whatever hangs: a thread of a library, or the
/// disk. Changes that were acknowledged have been stored.
inline void end_in(std::chrono::seconds time) {
  try {
    std::thread([time] {
      std::this_thread::sleep_for(time);
      constexpr std::string_view kLine =
          "a thread did not stop in time: the process ends without it\n";
      (void)!write(STDERR_FILENO, kLine.data(), kLine.size());
      std::_Exit(kRejected);
    }).detach();
  } catch (const std::system_error&) {  // there are too many threads
    (void)alarm(static_cast<unsigned>(time.count()));
  }
}

/// Less than service managers wait, and more than a slow disk needs.
constexpr std::chrono::seconds kStopTime{8};

/// Waits for a signal. Meanwhile feeds the watchdog of the service manager three times in its
/// interval, as long as the node responds.
[[nodiscard]] inline int wait_for_signal(Node& node, const sigset_t& signals) {
  const auto pause = watchdog_interval() / 3;
  int signal = 0;
  if (pause.count() <= 0) {
    sigwait(&signals, &signal);
    return signal;
  }
  const auto wait = std::chrono::duration_cast<Milliseconds>(pause);
  const timespec until{pause.count() / 1'000'000, pause.count() % 1'000'000 * 1000};
  while ((signal = sigtimedwait(&signals, nullptr, &until)) < 0) {
    if (node.responds(wait)) notify("WATCHDOG=1");
  }
  return signal;
}

/// Serves until a signal to stop, or until another process has taken the partition.
/// @param stop_signals  from block_stop_signals()
/// @return the exit status
[[nodiscard]] inline int wait_until_stopped(Node& node, const sigset_t& stop_signals) {
  std::atomic<bool> given_up{false};
  const auto subscription = node.on_taken([&](const Change&) {
    given_up = true;
    kill(getpid(), SIGTERM);
  });
  notify("READY=1\nSTATUS=serving partition " + quote(node.partition()));
  const int signal = wait_for_signal(node, stop_signals);
  notify("STOPPING=1");
  end_in(kStopTime);
  if (given_up) return kRejected;
  spdlog::info("stopping on signal {}", signal);
  return 0;
}

}  // namespace tfdude::cli
