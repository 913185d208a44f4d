#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <string>
#include <thread>

#include "tfdude/client/client.hpp"

#include "faults/journal.hpp"

namespace tfdude::faults {

/// Moves a frame to and fro between two bases while another client reads a watched path to it
/// without a pause. Each value that is read has to be that of one of the two ways; once all is
/// calm, each read has to give one.
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
  std::thread reading_;  // last: both use the rest
};

}  // namespace tfdude::faults
