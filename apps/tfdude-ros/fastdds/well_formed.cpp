#include "well_formed.hpp"

#include <atomic>

#include "base/cdr.hpp"

namespace tfdude::ros {
namespace {

// A longer sample would not fit into the memory that a message may take anyway.
constexpr std::uint32_t kMost = 1U << 26U;

std::atomic<std::uint64_t>& malformed() {
  static std::atomic<std::uint64_t> count{0};
  return count;
}

bool counted(const CdrReader& in) {
  if (!in.good()) malformed().fetch_add(1, std::memory_order_relaxed);
  return in.good();
}

void time(CdrReader& in) { in.skip(8, 4); }

void header(CdrReader& in) {
  time(in);
  in.bounded_text(kMost);
}

void doubles(CdrReader& in, std::size_t count) { in.skip(count * sizeof(double), 8); }

constexpr std::size_t kPose = 7;
constexpr std::size_t kTwist = 6;
constexpr std::size_t kCovariance = 36;

}  // namespace

bool well_formed_tf(const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  in.sequence(kMost, [&] {
    header(in);
    in.bounded_text(kMost);
    doubles(in, kPose);
  });
  return counted(in);
}

bool well_formed_joint_state(const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  header(in);
  in.sequence(kMost, [&] { in.bounded_text(kMost); });
  for (int i = 0; i < 3; ++i) in.numbers(kMost);  // positions, velocities, efforts
  return counted(in);
}

bool well_formed_string(const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  in.bounded_text(kMost);
  return counted(in);
}

bool well_formed_pose(const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  header(in);
  doubles(in, kPose + kCovariance);
  return counted(in);
}

bool well_formed_odometry(const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  header(in);
  in.bounded_text(kMost);
  doubles(in, kPose + kCovariance + kTwist + kCovariance);
  return counted(in);
}

bool well_formed_nav_sat_fix(const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  header(in);
  in.skip(1, 1);
  in.skip(2, 2);
  doubles(in, 3 + 9);
  in.skip(1, 1);
  return counted(in);
}

bool well_formed_geo_pose(const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  header(in);
  doubles(in, kPose);
  return counted(in);
}

bool well_formed_detections(const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  header(in);
  in.sequence(kMost, [&] {
    header(in);
    in.sequence(kMost, [&] {
      in.bounded_text(kMost);
      doubles(in, 1 + kPose + kCovariance);
    });
    doubles(in, kPose + 3);
    in.bounded_text(kMost);
  });
  return counted(in);
}

bool well_formed_tags(const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  header(in);
  in.sequence(kMost, [&] {
    in.bounded_text(kMost);
    in.skip(4, 4);
    doubles(in, 5 * 3);  // the centre and four corners
    header(in);
    doubles(in, kPose + kCovariance);
  });
  return counted(in);
}

bool well_formed_markers(const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  header(in);
  in.numbers(kMost);  // ids of 8 bytes
  in.sequence(kMost, [&] { doubles(in, kPose); });
  return counted(in);
}

bool well_formed_clock(const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  time(in);
  return counted(in);
}

std::uint64_t malformed_samples() { return malformed().load(std::memory_order_relaxed); }

}  // namespace tfdude::ros
