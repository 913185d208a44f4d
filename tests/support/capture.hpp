#pragma once

#include <atomic>
#include <cstddef>
#include <mutex>
#include <string>
#include <thread>

namespace tfdude::testing {

/// Records all IPv4 packets on the loopback interface. Needs root.
class Capture {
 public:
  Capture();
  ~Capture();
  Capture(const Capture&) = delete;
  Capture& operator=(const Capture&) = delete;

  /// False: not permitted here; nothing is recorded.
  [[nodiscard]] bool good() const { return socket_ >= 0; }

  /// All bytes so far, one packet after the other.
  [[nodiscard]] std::string bytes() const;

 private:
  void run();

  int socket_ = -1;
  std::atomic<bool> stopping_{false};
  mutable std::mutex mutex_;
  std::string bytes_;
  std::thread thread_;
};

}  // namespace tfdude::testing
