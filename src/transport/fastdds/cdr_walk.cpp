#include "transport/fastdds/cdr_check.hpp"

namespace tfdude::fastdds::detail {

CdrWalk::CdrWalk(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {
  // The encapsulation: two bytes of kind (0: big-endian, 1: little-endian plain CDR), two of
  // options.
  constexpr std::size_t kHeader = 4;
  if (data == nullptr || size < kHeader || data[0] != 0 || data[1] > 1) {
    good_ = false;
    return;
  }
  big_endian_ = data[1] == 0;
  data_ += kHeader;  // alignment counts from here
  size_ -= kHeader;
}

void CdrWalk::skip(std::size_t bytes, std::size_t alignment) {
  const std::size_t start = (at_ + alignment - 1) / alignment * alignment;
  good_ = good_ && start <= size_ && bytes <= size_ - start;
  if (good_) at_ = start + bytes;
}

std::uint8_t CdrWalk::octet() {
  skip(1, 1);
  return good_ ? data_[at_ - 1] : 0;
}

// The generated code throws at any other value.
void CdrWalk::boolean() {
  if (octet() > 1) good_ = false;
}

std::uint32_t CdrWalk::ulong() {
  skip(4, 4);
  if (!good_) return 0;
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    value |= static_cast<std::uint32_t>(data_[at_ - 4 + i]) << (8 * (big_endian_ ? 3 - i : i));
  }
  return value;
}

// The length, including the final zero, then the bytes. A zero inside would hide the rest.
std::string_view CdrWalk::string(std::size_t max_bytes) {
  const std::uint32_t length = ulong();
  if (!good_ || length == 0) return {};
  if (length - 1 > max_bytes) good_ = false;
  skip(length, 1);
  if (!good_) return {};
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): bytes as characters
  const std::string_view text(reinterpret_cast<const char*>(data_ + at_ - length), length - 1);
  if (data_[at_ - 1] != 0 || text.find('\0') != std::string_view::npos) good_ = false;
  return text;
}

void CdrWalk::numbers(std::uint32_t most) {
  const std::uint32_t length = ulong();
  if (length > most) good_ = false;
  if (length > 0) skip(length * sizeof(double), 8);
}

void CdrWalk::path_ends() {
  id();
  id();
}

void CdrWalk::transforms() {
  sequence([&] { transform(); });
}

void CdrWalk::correlation() {
  constexpr std::uint32_t kMaxLoading = 216;
  octet();
  numbers(Covariance::kSize);
  sequence(
      [&] {
        octet();
        numbers(kMaxLoading);
        id();
      },
      kMaxCorrelated);
  sequence([&] { id(); }, kMaxCorrelated);
}

void CdrWalk::correlated_transforms() {
  skip(4 * 8, 8);
  transforms();
  transforms();
  sequence([&] { correlation(); }, kMaxCorrelated);
  sequence([&] { correlation(); }, kMaxCorrelated);
}

void CdrWalk::unspecified_edges() {
  sequence([&] {
    ulong();
    id();
  });
}

void CdrWalk::revised_edge() {
  skip(3 * 8, 8);
  id();
  octet();
  octet();
  transform();
  correlation();
}

void CdrWalk::state() {
  skip(3 * 8, 8);
  ulong();
  ulong();
  sequence([&] {
    skip(2 * 8, 8);
    ulong();
    ulong();
    transform();
  });
  sequence(
      [&] {
        ulong();
        correlation();
      },
      kMaxCorrelated);
  sequence([&] {
    ulong();
    numbers(Covariance::kSize);
  });
}

std::string_view CdrWalk::edge() {
  const std::string_view child = id();
  transform();
  return child;
}

std::string_view CdrWalk::joint() {
  const std::string_view name = id();
  numbers(2);
  return name;
}

}  // namespace tfdude::fastdds::detail
