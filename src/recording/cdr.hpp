#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "recording/bytes.hpp"

// XCDR1 as ROS 2 has it in recordings: little-endian, after a head of four bytes.
namespace tfdude::recording {

inline constexpr std::string_view kCdrHead{"\0\1\0\0", 4};

class CdrWriter {
 public:
  /// Starts a message.
  explicit CdrWriter(std::string& out) : out_(out), bytes_(out) { out_.assign(kCdrHead); }

  void u8(std::uint8_t value) { bytes_.u8(value); }
  void flag(bool value) { bytes_.u8(value ? 1 : 0); }
  void u32(std::uint32_t value) {
    align(4);
    bytes_.u32(value);
  }
  void u64(std::uint64_t value) {
    align(8);
    bytes_.u64(value);
  }
  void i64(std::int64_t value) { u64(static_cast<std::uint64_t>(value)); }
  void f64(double value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    u64(bits);
  }
  void text(std::string_view value) {
    u32(static_cast<std::uint32_t>(value.size() + 1));
    out_.append(value);
    out_.push_back('\0');
  }
  template <class Numbers>
  void f64s(const Numbers& values) {
    for (const double value : values) f64(value);
  }
  /// A number that is set later. @return its place
  [[nodiscard]] std::size_t later() {
    u32(0);
    return out_.size() - 4;
  }
  void set(std::size_t place, std::uint32_t value) { bytes_.set_u32(place, value); }

 private:
  void align(std::size_t size) {
    const std::size_t past = (out_.size() - kCdrHead.size()) % size;
    if (past != 0) out_.append(size - past, '\0');
  }

  std::string& out_;
  ByteWriter bytes_;
};

/// Reads a message of unknown origin; as ByteReader. Big-endian messages are not good().
class CdrReader {
 public:
  explicit CdrReader(std::string_view message)
      : size_(message.size()),
        good_(message.size() >= 4 && message[0] == '\0' && message[1] == '\1'),
        bytes_(message) {
    (void)bytes_.bytes(4);
  }

  [[nodiscard]] bool good() const { return good_ && bytes_.good(); }
  [[nodiscard]] std::size_t left() const { return good_ ? bytes_.left() : 0; }

  [[nodiscard]] std::uint8_t u8() { return bytes_.u8(); }
  [[nodiscard]] bool flag() { return bytes_.u8() != 0; }
  [[nodiscard]] std::uint32_t u32() {
    align(4);
    return bytes_.u32();
  }
  [[nodiscard]] std::uint64_t u64() {
    align(8);
    return bytes_.u64();
  }
  [[nodiscard]] std::int64_t i64() { return static_cast<std::int64_t>(u64()); }
  [[nodiscard]] double f64() {
    const std::uint64_t bits = u64();
    double value = 0;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }
  [[nodiscard]] std::string_view text() {
    const std::string_view value = bytes_.bytes(u32());
    // Some writers count no zero at the end of an empty text.
    return value.empty() || value.back() != '\0' ? value : value.substr(0, value.size() - 1);
  }
  template <class Numbers>
  void f64s(Numbers& values) {
    for (double& value : values) value = f64();
  }
  /// The length of a sequence; not good() if there is no room for elements of this least size.
  [[nodiscard]] std::uint32_t count(std::size_t least) {
    const std::uint32_t value = u32();
    if (good() && value <= bytes_.left() / least) return value;
    good_ = false;
    return 0;
  }

 private:
  void align(std::size_t size) {
    const std::size_t past = (size_ - bytes_.left() - 4) % size;
    if (past != 0) (void)bytes_.bytes(size - past);
  }

  const std::size_t size_;
  bool good_;
  ByteReader bytes_;
};

}  // namespace tfdude::recording
