#pragma once

#include <cstddef>

namespace tfdude {

/// What was found in the transforms of a recording of ROS. The rules are those of the bridge
/// (docs/ros.md).
struct TransformCounts {
  std::size_t messages = 0;   ///< left out: cannot be read
  std::size_t names = 0;      ///< left out: a name that cannot be an id
  std::size_t values = 0;     ///< left out: not a rigid transform, or a frame in itself
  std::size_t cycles = 0;     ///< left out: the parent is below the frame
  std::size_t repeated = 0;   ///< left out: another value for a stamp that was there before
  std::size_t old = 0;        ///< left out: older than the stamps that are remembered
  std::size_t early = 0;      ///< left out: a negative stamp
  std::size_t same = 0;       ///< repeats of a sample; they change nothing
  std::size_t unstamped = 0;  ///< a stamp of 0; taken as of the time of the message
  std::size_t jumps = 0;      ///< the time of an edge went back: its earlier samples were dropped

  [[nodiscard]] std::size_t left_out() const {
    return messages + names + values + cycles + repeated + old + early;
  }
  TransformCounts& operator+=(const TransformCounts& other) {
    messages += other.messages;
    names += other.names;
    values += other.values;
    cycles += other.cycles;
    repeated += other.repeated;
    old += other.old;
    early += other.early;
    same += other.same;
    unstamped += other.unstamped;
    jumps += other.jumps;
    return *this;
  }
};

}  // namespace tfdude
