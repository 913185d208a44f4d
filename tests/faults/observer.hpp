#pragma once

#include <atomic>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/client.hpp"

#include "faults/journal.hpp"

namespace tfdude::faults {

/// Measures how long it takes until a killed daemon counts as gone, and until a started daemon
/// answers a lookup of its own edge. Both are measured by a client whose own link is never cut.
/// Thread-safe.
class Observer {
 public:
  explicit Observer(Client client);
  ~Observer();
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  [[nodiscard]] Client& client() { return client_; }

  void died(std::size_t partition);
  void started(std::size_t partition);
  /// Another fault hits a partition, which makes its current measurement meaningless.
  void disregard(std::size_t partition);

  /// The measured times [ms].
  [[nodiscard]] std::vector<double> until_gone() const;
  [[nodiscard]] std::vector<double> until_answer() const;
  /// The number of measurements that are not finished.
  [[nodiscard]] std::size_t open() const;

 private:
  void ask_those_started();

  Client client_;
  mutable std::mutex mutex_;
  std::map<std::string, Clock::time_point> died_;
  std::map<std::size_t, Clock::time_point> started_;
  std::vector<double> until_gone_;
  std::vector<double> until_answer_;
  std::atomic<bool> stopping_{false};
  Subscription subscription_;
  std::thread asking_;
};

}  // namespace tfdude::faults
