#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "calls/call.hpp"

namespace tfdude {

/// Replaces samples of an edge within an interval: sends them to its owner in parts, a few at a
/// time, and then the last one, with which the owner applies all of them. If the owner has lost
/// some meanwhile, all are sent again.
class RewriteTask final : public Task {
 public:
  /// Parts that are sent without waiting for replies: as many bytes as the socket of any receiver
  /// has room for.
  static constexpr std::size_t kAtOnce = 4;

  /// @param number  that no other rewrite of this participant has
  /// @param samples  must outlive this
  RewriteTask(const Forest& forest, std::string id, std::uint64_t number,
              const TimeInterval& interval, const std::vector<EdgeSample>& samples)
      : forest_(forest),
        id_(std::move(id)),
        number_(number),
        interval_(interval),
        samples_(samples) {}

  [[nodiscard]] std::vector<std::string> frames() const override { return {id_}; }
  [[nodiscard]] Result<void> plan(const Directory& directory, Clock::time_point now) override;
  [[nodiscard]] std::vector<Part>& parts() override { return parts_; }
  [[nodiscard]] Result<Next> take(std::vector<Reply> replies, Clock::time_point now) override;

 private:
  static constexpr int kAttempts = 3;

  void send_next();

  const Forest& forest_;
  const std::string id_;
  const std::uint64_t number_;
  const TimeInterval interval_;
  const std::vector<EdgeSample>& samples_;
  Part route_;
  std::vector<Part> parts_;
  std::size_t sent_ = 0;  // samples
  int torn_ = 0;          // how often the owner has lost parts
};

}  // namespace tfdude
