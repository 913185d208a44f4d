#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "tfdude/base/time.hpp"
#include "tfdude/math/transform.hpp"

// The binary messages to a page (docs/web.md has the layouts). All numbers are little-endian.
namespace tfdude::web {

/// The first byte of a binary message.
enum class Kind : std::uint8_t { kValues = 1, kCovariances = 2 };

/// Appends records to one message. A page drops a message whose structure it does not have.
class Message {
 public:
  /// @param base  to which the stamps of the records are relative
  /// @param past  the message describes an instant that the page has asked for
  Message(Kind kind, std::uint32_t structure, Time base, bool past);

  /// 26 bytes, or 38 if a coordinate exceeds kWide.
  void add_value(std::uint32_t index, const Pose& X_PC, const std::optional<Time>& stamp);
  /// 88 bytes, or 4 if the covariance is unspecified or zero.
  void add_covariance(std::uint32_t index, const StatedCovariance& covariance, bool correlated);

  [[nodiscard]] std::uint32_t count() const { return count_; }
  /// The message, complete.
  [[nodiscard]] std::string finish();

  /// Coordinates beyond this [m] are sent as doubles, the others as floats.
  static constexpr double kWide = 1000;

 private:
  std::string bytes_;
  Time base_;
  std::uint32_t count_ = 0;
};

}  // namespace tfdude::web
