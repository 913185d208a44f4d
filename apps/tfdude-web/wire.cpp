#include "wire.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace tfdude::web {
namespace {

constexpr std::size_t kCountAt = 16;
// Bits of an index word.
constexpr unsigned kLargestShift = 30;
constexpr std::uint32_t kWideBit = 1U << 29U;
constexpr std::uint32_t kUnspecifiedBit = 1U << 31U;
constexpr std::uint32_t kCorrelatedBit = 1U << 30U;
constexpr std::uint32_t kZeroBit = 1U << 29U;
// A stamp that means: the value holds for all times.
constexpr std::int32_t kStatic = INT32_MIN;
constexpr std::int64_t kStampUnit = 100'000;  // [ns]

template <class T>
void put(std::string& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

std::int32_t relative(const std::optional<Time>& stamp, Time base) {
  if (!stamp) return kStatic;
  const std::int64_t units = (*stamp - base).count() / kStampUnit;
  return static_cast<std::int32_t>(
      std::clamp<std::int64_t>(units, std::int64_t{INT32_MIN} + 1, INT32_MAX));
}

// A component but the largest is at most 1/sqrt(2).
std::int16_t packed(double component) {
  const double scaled = component * std::sqrt(2.0) * INT16_MAX;
  return static_cast<std::int16_t>(std::clamp<double>(std::round(scaled), -INT16_MAX, INT16_MAX));
}

}  // namespace

Message::Message(Kind kind, std::uint32_t structure, Time base, bool past) : base_(base) {
  put(bytes_, static_cast<std::uint8_t>(kind));
  put(bytes_, static_cast<std::uint8_t>(past ? 1 : 0));
  put(bytes_, std::uint16_t{0});
  put(bytes_, structure);
  put(bytes_, nanoseconds(base));
  put(bytes_, count_);
}

void Message::add_value(std::uint32_t index, const Pose& X_PC, const std::optional<Time>& stamp) {
  const Eigen::Vector3d p = X_PC.translation();
  const Eigen::Quaterniond rotation = X_PC.rotation();
  const std::array<double, 4> q = {rotation.x(), rotation.y(), rotation.z(), rotation.w()};
  const auto largest = static_cast<std::size_t>(
      std::max_element(q.begin(), q.end(),
                       [](double a, double b) { return std::abs(a) < std::abs(b); }) -
      q.begin());
  const bool wide = p.cwiseAbs().maxCoeff() > kWide;
  put(bytes_,
      index | (static_cast<std::uint32_t>(largest) << kLargestShift) | (wide ? kWideBit : 0U));
  put(bytes_, relative(stamp, base_));
  for (const double coordinate : {p.x(), p.y(), p.z()}) {
    if (wide) {
      put(bytes_, coordinate);
    } else {
      put(bytes_, static_cast<float>(coordinate));
    }
  }
  const double sign = q[largest] < 0 ? -1 : 1;
  for (std::size_t i = 0; i < q.size(); ++i) {
    if (i != largest) put(bytes_, packed(sign * q[i]));
  }
  ++count_;
}

void Message::add_covariance(std::uint32_t index, const StatedCovariance& covariance,
                             bool correlated) {
  const Covariance::Upper& upper = covariance.of_specified().upper();
  const bool zero =
      std::all_of(upper.begin(), upper.end(), [](double entry) { return entry == 0; });
  const bool unspecified = !covariance.complete();
  put(bytes_, index | (unspecified ? kUnspecifiedBit : 0U) | (correlated ? kCorrelatedBit : 0U) |
                  (zero ? kZeroBit : 0U));
  if (!zero && !unspecified) {
    for (const double entry : upper) put(bytes_, static_cast<float>(entry));
  }
  ++count_;
}

std::string Message::finish() {
  std::memcpy(bytes_.data() + kCountAt, &count_, sizeof(count_));
  return std::move(bytes_);
}

}  // namespace tfdude::web
