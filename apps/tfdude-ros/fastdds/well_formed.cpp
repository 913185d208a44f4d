#include "well_formed.hpp"

#include <atomic>

#include "transport/fastdds/cdr_check.hpp"

namespace tfdude::ros {
namespace {

using fastdds::detail::CdrWalk;

// A longer sample would not fit into the memory that a message may take anyway.
constexpr std::uint32_t kMost = 1U << 26U;

std::atomic<std::uint64_t>& malformed() {
  static std::atomic<std::uint64_t> count{0};
  return count;
}

bool counted(const CdrWalk& walk) {
  if (!walk.good()) malformed().fetch_add(1, std::memory_order_relaxed);
  return walk.good();
}

void time(CdrWalk& walk) { walk.skip(8, 4); }

void header(CdrWalk& walk) {
  time(walk);
  walk.string(kMost);
}

void doubles(CdrWalk& walk, std::size_t count) { walk.skip(count * sizeof(double), 8); }

constexpr std::size_t kPose = 7;
constexpr std::size_t kTwist = 6;
constexpr std::size_t kCovariance = 36;

}  // namespace

bool well_formed_tf(const std::uint8_t* data, std::size_t size) {
  CdrWalk walk(data, size);
  walk.sequence(
      [&] {
        header(walk);
        walk.string(kMost);
        doubles(walk, kPose);
      },
      kMost);
  return counted(walk);
}

bool well_formed_joint_state(const std::uint8_t* data, std::size_t size) {
  CdrWalk walk(data, size);
  header(walk);
  walk.sequence([&] { walk.string(kMost); }, kMost);
  for (int i = 0; i < 3; ++i) walk.numbers(kMost);  // positions, velocities, efforts
  return counted(walk);
}

bool well_formed_string(const std::uint8_t* data, std::size_t size) {
  CdrWalk walk(data, size);
  walk.string(kMost);
  return counted(walk);
}

bool well_formed_pose(const std::uint8_t* data, std::size_t size) {
  CdrWalk walk(data, size);
  header(walk);
  doubles(walk, kPose + kCovariance);
  return counted(walk);
}

bool well_formed_odometry(const std::uint8_t* data, std::size_t size) {
  CdrWalk walk(data, size);
  header(walk);
  walk.string(kMost);
  doubles(walk, kPose + kCovariance + kTwist + kCovariance);
  return counted(walk);
}

bool well_formed_clock(const std::uint8_t* data, std::size_t size) {
  CdrWalk walk(data, size);
  time(walk);
  return counted(walk);
}

std::uint64_t malformed_samples() { return malformed().load(std::memory_order_relaxed); }

}  // namespace tfdude::ros
