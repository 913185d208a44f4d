#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include <spdlog/details/log_msg.h>
#include <spdlog/sinks/sink.h>

namespace tfdude::cli {

/// Passes on a limited number of lines per minute, and then says how many were left out: what
/// others send may be logged, and must not fill the disk.
class BoundedSink final : public spdlog::sinks::sink {
 public:
  using Clock = std::chrono::steady_clock;

  static constexpr std::uint64_t kLinesPerMinute = 1000;

  explicit BoundedSink(spdlog::sink_ptr to) : to_(std::move(to)) {}

  void log(const spdlog::details::log_msg& message) override { log(message, Clock::now()); }

  /// @param now  the time
  void log(const spdlog::details::log_msg& message, Clock::time_point now) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (lines_ == 0 || now - began_ >= std::chrono::minutes(1)) {
      if (lines_ > kLinesPerMinute) tell_left_out(message, lines_ - kLinesPerMinute);
      began_ = now;
      lines_ = 0;
    }
    if (++lines_ <= kLinesPerMinute) to_->log(message);
  }

  void flush() override { to_->flush(); }
  void set_pattern(const std::string& pattern) override { to_->set_pattern(pattern); }
  void set_formatter(std::unique_ptr<spdlog::formatter> formatter) override {
    to_->set_formatter(std::move(formatter));
  }

 private:
  void tell_left_out(const spdlog::details::log_msg& next, std::uint64_t lines) {
    const std::string text = std::to_string(lines) + " lines of the log were left out";
    to_->log({next.time, {}, next.logger_name, spdlog::level::warn, text});
  }

  const spdlog::sink_ptr to_;
  std::mutex mutex_;
  Clock::time_point began_{};
  std::uint64_t lines_ = 0;  // since then
};

}  // namespace tfdude::cli
