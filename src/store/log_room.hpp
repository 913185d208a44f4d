#pragma once

#include <cstdint>
#include <string>
#include <utility>

namespace tfdude {

/// Sets room on the disk aside for what will be appended to a log, without changing its size.
/// Not thread-safe.
class LogRoom {
 public:
  /// What a change of some thirty frames needs.
  static constexpr std::int64_t kBytes = 128 * 1024;

  explicit LogRoom(std::string log) : log_(std::move(log)) {}

  /// @return false: the disk does not have it. True also where a file system cannot tell.
  [[nodiscard]] bool reserve();
  /// Whether the log would have it if it were written from its beginning.
  [[nodiscard]] bool is_inside() const;

 private:
  const std::string log_;
  std::int64_t reserved_ = 0;  // up to this byte of the log
};

}  // namespace tfdude
