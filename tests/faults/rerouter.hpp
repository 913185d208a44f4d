#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <string>
#include <thread>

#include "tfdude/client/client.hpp"

#include "faults/journal.hpp"

namespace tfdude::faults {

/// Moves a frame back and forth between two bases while another client continuously reads a watched
/// path to it. Each value must be that of one of the two paths; without faults, each read must give
/// a value.
class Rerouter {
 public:
  Rerouter(Client mover, Client watcher, std::size_t partitions, Journal& journal);
  ~Rerouter() { stop(); }
  Rerouter(const Rerouter&) = delete;
  Rerouter& operator=(const Rerouter&) = delete;

  void stop();

 private:
  void move();
  void read();
  void judge(const Result<StampedTransform>& X_WS, double calm);

  Client mover_;
  Client watcher_;
  Journal& journal_;
  const std::string owner_;
  const std::array<std::string, 2> parents_;
  const std::array<Transform, 2> X_PS_;  // below each
  std::array<Eigen::Vector3d, 2> legal_;
  std::atomic<bool> stopping_{false};
  std::thread moving_;
  std::thread reading_;  // last: both threads use the other members
};

}  // namespace tfdude::faults
