// As much of rclcpp as the node of the test needs.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace builtin_interfaces::msg {
struct Time {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
};
}  // namespace builtin_interfaces::msg

namespace rclcpp {

class Duration {
 public:
  explicit Duration(std::int64_t nanoseconds) : nanoseconds_(nanoseconds) {}
  static Duration from_seconds(double seconds) {
    return Duration(static_cast<std::int64_t>(seconds * 1e9));
  }
  [[nodiscard]] std::int64_t nanoseconds() const { return nanoseconds_; }

 private:
  std::int64_t nanoseconds_;
};

class Time {
 public:
  explicit Time(std::int64_t nanoseconds = 0) : nanoseconds_(nanoseconds) {}
  // NOLINTNEXTLINE(google-explicit-constructor): as in rclcpp
  Time(const builtin_interfaces::msg::Time& time)
      : nanoseconds_(std::int64_t{time.sec} * 1'000'000'000 + time.nanosec) {}
  [[nodiscard]] std::int64_t nanoseconds() const { return nanoseconds_; }

 private:
  std::int64_t nanoseconds_;
};

class Clock {};

class Node {
 public:
  explicit Node(std::string name) : name_(std::move(name)) {}
  [[nodiscard]] std::shared_ptr<Clock> get_clock() { return std::make_shared<Clock>(); }
  [[nodiscard]] std::vector<std::string>& get_logger() { return log_; }

 private:
  std::string name_;
  std::vector<std::string> log_;
};

}  // namespace rclcpp

#define RCLCPP_WARN(logger, format, text) (logger).push_back(text)
