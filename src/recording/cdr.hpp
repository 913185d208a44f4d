#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "recording/bytes.hpp"

// XCDR1 as ROS 2 has it in recordings: little-endian, after a head of four bytes.
namespace tfdude::recording {

inline constexpr std::string_view kCdrHead{"\0\1\0\0", 4};

/// Writes a message over what a string has, which saves the time to fill it. The string is the
/// message after finish(), or after the writer's end.
class CdrWriter {
 public:
  explicit CdrWriter(std::string& out) : out_(&out) {
    std::memcpy(room(kCdrHead.size()), kCdrHead.data(), kCdrHead.size());
  }
  CdrWriter(const CdrWriter&) = delete;
  CdrWriter& operator=(const CdrWriter&) = delete;
  ~CdrWriter() { finish(); }

  void finish() {
    if (out_ != nullptr) out_->resize(size_);
    out_ = nullptr;
  }

  void u8(std::uint8_t value) { *room(1) = static_cast<char>(value); }
  void flag(bool value) { u8(value ? 1 : 0); }
  void u32(std::uint32_t value) {
    align(4);
    put_number(room(4), value);
  }
  void u64(std::uint64_t value) {
    align(8);
    put_number(room(8), value);
  }
  void i64(std::int64_t value) { u64(static_cast<std::uint64_t>(value)); }
  void f64(double value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    u64(bits);
  }
  void text(std::string_view value) {
    u32(static_cast<std::uint32_t>(value.size() + 1));
    char* to = room(value.size() + 1);
    std::memcpy(to, value.data(), value.size());
    to[value.size()] = '\0';
  }
  template <class Numbers>
  void f64s(const Numbers& values) {
    for (const double value : values) f64(value);
  }
  /// A number that is set later. @return its place
  [[nodiscard]] std::size_t later() {
    u32(0);
    return size_ - 4;
  }
  void set(std::size_t place, std::uint32_t value) { put_number(out_->data() + place, value); }

 private:
  // The next bytes, to be written.
  char* room(std::size_t count) {
    if (out_->size() - size_ < count) out_->resize(size_ + count + size_ / 2);
    char* at = out_->data() + size_;
    size_ += count;
    return at;
  }
  void align(std::size_t size) {
    for (std::size_t past = (size_ - kCdrHead.size()) % size; past % size != 0; ++past) u8(0);
  }

  std::string* out_;
  std::size_t size_ = 0;
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
