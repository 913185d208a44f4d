#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>

#include "base/bytes.hpp"

// Plain CDR (XCDR1), as DDS and ROS 2 send and record it. Each number stands at a multiple of its
// size, counted from the end of the head: two bytes of kind (0: big-endian, 1: little-endian) and
// two of options.
namespace tfdude {

inline constexpr std::string_view kCdrHead{"\0\1\0\0", 4};

/// Reads a message of unknown origin, of either byte order. After the first step beyond the end, or
/// beyond a bound, good() is false, and everything else is zero or empty.
class CdrReader {
 public:
  CdrReader(const std::uint8_t* data, std::size_t size)
      : data_(data),
        size_(size),
        good_(data != nullptr && size >= kCdrHead.size() && data[0] == 0 && data[1] <= 1) {
    if (!good_) return;
    big_endian_ = data[1] == 0;
    data_ += kCdrHead.size();
    size_ -= kCdrHead.size();
  }
  explicit CdrReader(std::string_view message)
      // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): characters as bytes
      : CdrReader(reinterpret_cast<const std::uint8_t*>(message.data()), message.size()) {}

  [[nodiscard]] bool good() const { return good_; }
  [[nodiscard]] std::size_t left() const { return good_ ? size_ - at_ : 0; }

  void skip(std::size_t bytes, std::size_t alignment) { (void)take(bytes, alignment); }

  [[nodiscard]] std::uint8_t u8() { return number<std::uint8_t>(); }
  [[nodiscard]] bool flag() { return u8() != 0; }
  [[nodiscard]] std::uint32_t u32() { return number<std::uint32_t>(); }
  [[nodiscard]] std::uint64_t u64() { return number<std::uint64_t>(); }
  [[nodiscard]] std::int64_t i64() { return static_cast<std::int64_t>(u64()); }
  [[nodiscard]] double f64() { return as_f64(u64()); }
  template <class Numbers>
  void f64s(Numbers& values) {
    if (values.size() == 0) return;  // without a number nothing is aligned
    const std::uint8_t* raw = take(values.size() * sizeof(double), sizeof(double));
    for (double& value : values) {
      value = raw != nullptr ? as_f64(number_at<std::uint64_t>(raw)) : 0;
      if (raw != nullptr) raw += sizeof(double);
    }
  }

  /// A text, whose length counts the zero at its end. Some writers leave that zero out.
  [[nodiscard]] std::string_view text() {
    const std::uint32_t size = u32();
    const std::uint8_t* raw = take(size, 1);
    if (raw == nullptr || size == 0) return {};
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): bytes as characters
    const std::string_view all(reinterpret_cast<const char*>(raw), size);
    return all.back() != '\0' ? all : all.substr(0, size - 1);
  }
  /// A text of limited length with a zero at its end, and none within, which would hide the rest
  /// from code that reads up to a zero.
  std::string_view bounded_text(std::size_t most) {
    const std::string_view value = text();
    const bool ended = value.empty() || data_[at_ - 1] == 0;
    if (value.size() > most || !ended || value.find('\0') != std::string_view::npos) fail();
    return good_ ? value : std::string_view();
  }

  /// The length of a sequence of elements that take at least so many bytes each.
  [[nodiscard]] std::uint32_t count(
      std::size_t least, std::uint32_t most = std::numeric_limits<std::uint32_t>::max()) {
    const std::uint32_t value = u32();
    if (value > most || value > left() / least) fail();
    return good_ ? value : 0;
  }
  /// Reads a sequence: calls element() for each, as long as all is good.
  template <class Element>
  void sequence(std::uint32_t most, Element element) {
    for (std::uint32_t left = count(1, most); left > 0 && good_; --left) element();
  }
  /// Skips a sequence of doubles.
  void numbers(std::uint32_t most) {
    const std::uint32_t length = count(sizeof(double), most);
    if (length > 0) skip(length * sizeof(double), sizeof(double));
  }

  /// For a value that is not possible.
  void fail() { good_ = false; }

 private:
  // Null if there are not as many.
  const std::uint8_t* take(std::size_t bytes, std::size_t alignment) {
    const std::size_t start = (at_ + alignment - 1) & ~(alignment - 1);
    good_ = good_ && start <= size_ && bytes <= size_ - start;
    if (!good_) return nullptr;
    at_ = start + bytes;
    return data_ + start;
  }

  template <class Number>
  Number number() {
    const std::uint8_t* raw = take(sizeof(Number), sizeof(Number));
    return raw != nullptr ? number_at<Number>(raw) : Number{};
  }
  template <class Number>
  [[nodiscard]] Number number_at(const std::uint8_t* raw) const {
    std::uint64_t value = 0;
    if (big_endian_) {
      for (std::size_t i = 0; i < sizeof(Number); ++i) value = value << 8U | raw[i];
    } else {
      for (std::size_t i = sizeof(Number); i > 0; --i) value = value << 8U | raw[i - 1];
    }
    return static_cast<Number>(value);
  }

  static double as_f64(std::uint64_t bits) {
    double value = 0;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }

  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t at_ = 0;
  bool big_endian_ = false;
  bool good_;
};

/// Writes a little-endian message over what a string has, which saves the time to fill it. The
/// string is the message after finish(), or after the writer's end.
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

}  // namespace tfdude
