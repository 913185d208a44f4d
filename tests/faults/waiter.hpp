#pragma once

#include <atomic>
#include <cstddef>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/client.hpp"

#include "faults/journal.hpp"

namespace tfdude::faults {

/// Two clients that go on across deaths and returns. One always has a lookup of a frame of each
/// partition that waits for ten minutes: it must be answered once all owners are back. The other
/// one streams to these frames through one stream: without faults all must be sent, and arrive.
class Waiter {
 public:
  Waiter(Client waiting, Client streaming, std::size_t partitions, Journal& journal);
  ~Waiter() { stop(); }
  Waiter(const Waiter&) = delete;
  Waiter& operator=(const Waiter&) = delete;

  void stop();

 private:
  struct Waiting {
    std::future<Result<StampedTransform>> answer;
    double since = 0;  // as Journal::now()
    bool reported = false;
  };

  void add_frames();
  void wait();
  void attend(std::size_t partition, Waiting& waiting);
  void stream();
  void check_arrival(std::size_t partition, double least);

  Client waiting_;
  Client streaming_;
  Journal& journal_;
  std::vector<std::string> frames_;  // one of each partition
  std::atomic<bool> stopping_{false};
  std::thread waits_;
  std::thread streams_;  // last: both threads use the other members
};

}  // namespace tfdude::faults
