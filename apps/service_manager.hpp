#pragma once

#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <memory>
#include <string>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <spdlog/pattern_formatter.h>

#include "environment.hpp"

// What a program tells systemd if that has started it: the protocols of sd_notify(3) and of
// sd-daemon(3). Without systemd all of this does nothing.
namespace tfdude::cli {

/// Tells the service manager a state, such as "READY=1".
inline void notify(const std::string& state) {
  const std::string path = environment("NOTIFY_SOCKET");
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof(address.sun_path)) return;
  std::memcpy(address.sun_path, path.data(), path.size());
  if (path[0] == '@') address.sun_path[0] = 0;  // an abstract socket
  const int file = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (file < 0) return;
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size());
  (void)sendto(file, state.data(), state.size(), MSG_NOSIGNAL,
               reinterpret_cast<const sockaddr*>(&address), length);
  close(file);
}

/// The interval at which the service manager expects "WATCHDOG=1"; 0: it does not.
[[nodiscard]] inline std::chrono::microseconds watchdog_interval() {
  const std::string process = environment("WATCHDOG_PID");
  if (!process.empty() && process != std::to_string(getpid())) return {};
  return std::chrono::microseconds(std::atoll(environment("WATCHDOG_USEC").c_str()));
}

/// Whether a file is what the service manager has connected with the journal.
[[nodiscard]] inline bool is_journal(int file) {
  struct stat about = {};
  return fstat(file, &about) == 0 &&
         environment("JOURNAL_STREAM") ==
             std::to_string(about.st_dev) + ":" + std::to_string(about.st_ino);
}

/// The level of a message as the journal takes it from the beginning of a line: <3> is an error.
class JournalLevel final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm& /*time*/,
              spdlog::memory_buf_t& line) override {
    constexpr const char* kDigits = "7764326";  // of trace, debug, info, warning, error, critical
    line.push_back(kDigits[message.level]);
  }
  [[nodiscard]] std::unique_ptr<spdlog::custom_flag_formatter> clone() const override {
    return std::make_unique<JournalLevel>();
  }
};

}  // namespace tfdude::cli
