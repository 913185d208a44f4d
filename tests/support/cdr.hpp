#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace tfdude::testing {

using Bytes = std::vector<std::uint8_t>;

/// Builds plain CDR by hand, valid or not.
class Cdr {
 public:
  explicit Cdr(bool big_endian = false) : big_endian_(big_endian) {
    bytes_ = {0, static_cast<std::uint8_t>(big_endian ? 0 : 1), 0, 0};
  }

  Cdr& octet(unsigned value) { return number(value, 1); }
  Cdr& ushort(unsigned value) { return number(value, 2); }
  Cdr& ulong(std::uint64_t value) { return number(value, 4); }
  Cdr& ulonglong(std::uint64_t value) { return number(value, 8); }
  Cdr& string(const std::string& text) { return string(text, text.size() + 1); }
  Cdr& string(const std::string& text, std::uint64_t length) {
    ulong(length);
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    bytes_.push_back(0);
    return *this;
  }
  Cdr& numbers(std::uint64_t count) {
    ulong(count);
    for (std::uint64_t i = 0; i < count; ++i) ulonglong(0);
    return *this;
  }
  Cdr& transform() { return numbers(28); }
  /// What comes before the body of a request.
  Cdr& head(const std::string& id) { return string(id).ulong(0).ulong(0).ulonglong(0); }
  Cdr& edge(const std::string& id) { return string(id).transform(); }

  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  Cdr& number(std::uint64_t value, std::size_t size) {
    while ((bytes_.size() - 4) % size != 0) bytes_.push_back(0);
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t shift = 8 * (big_endian_ ? size - 1 - i : i);
      bytes_.push_back(static_cast<std::uint8_t>(value >> shift));
    }
    return *this;
  }

  bool big_endian_;
  Bytes bytes_;
};

}  // namespace tfdude::testing
