#include "transport/fastdds/cdr_check.hpp"

#include "transport/fastdds/kinds.hpp"

namespace tfdude::fastdds {
namespace detail {

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

}  // namespace detail

namespace {

using detail::CdrWalk;

constexpr std::size_t kMaxMessage = 4096;

void change_body(CdrWalk& walk, RequestKind kind) {
  switch (kind) {
    case kAdd:
      walk.id();
      walk.transform();
      walk.skip(8, 8);
      break;
    case kRemove:
      walk.sequence([&] { walk.id(); });
      walk.skip(8, 8);
      break;
    case kUpdate:
      walk.transform();
      walk.skip(8, 8);
      walk.sequence([&] { walk.edge(); });
      break;
    case kMove:
      walk.id();
      walk.skip(8, 8);
      break;
    case kMoveAndUpdate:
      walk.id();
      walk.octet();
      walk.transform();
      walk.skip(8, 8);
      break;
    case kRevise:
      walk.skip(3 * 8, 8);
      walk.sequence([&] { walk.revised_edge(); }, kMaxCorrelated);
      break;
    case kJoints:
      walk.sequence([&] { walk.joint(); });
      walk.skip(8, 8);
      break;
    case kPartialUpdate:
      walk.skip(8, 8);
      walk.sequence([&] {
        walk.id();
        walk.octet();
        walk.transform();
      });
      break;
    case kCorrelate:
      walk.correlation();
      break;
    case kForget:
      walk.skip(8, 8);
      walk.id();
      break;
    default:;  // a request of a later version, which is rejected by name
  }
}

void request_body(CdrWalk& walk) {
  const auto kind = static_cast<RequestKind>(walk.octet());
  switch (kind) {
    case kLookup:
      walk.sequence([&] { walk.path_ends(); });
      break;
    case kLookupAt:
      walk.skip(4 * 8, 8);
      walk.sequence([&] { walk.path_ends(); });
      walk.octet();
      walk.octet();
      break;
    case kWatch:
      walk.skip(2 * 8, 8);
      walk.sequence([&] { walk.path_ends(); });
      walk.octet();
      break;
    case kHistory:
    case kConsistency:
    case kProbe:
      walk.octet();
      break;
    case kJointStates:
      walk.id();
      break;
    case kFrames:
      walk.sequence([&] { walk.id(); });
      walk.sequence([&] { walk.id(); });
      walk.sequence([&] {
        walk.skip(8, 8);
        walk.id();
      });
      break;
    default:
      change_body(walk, kind);
  }
}

}  // namespace

bool read_request_head(const std::uint8_t* data, std::size_t size, RequestHead& head) {
  CdrWalk walk(data, size);
  head.id = walk.id();
  head.addressee = walk.ulong();
  walk.ulong();
  walk.skip(8, 8);
  request_body(walk);
  return walk.good();
}

bool well_formed_request(const std::uint8_t* data, std::size_t size) {
  RequestHead head;
  return read_request_head(data, size, head);
}

bool well_formed_reply(const std::uint8_t* data, std::size_t size) {
  CdrWalk walk(data, size);
  walk.skip(2 * 8, 8);
  walk.ulong();
  switch (walk.octet()) {
    case kError:
      walk.octet();
      walk.string(kMaxMessage);
      break;
    case kTransforms:
      walk.transforms();
      break;
    case kDoneReply:
    case kAlive:
      walk.octet();
      break;
    case kStamped:
      walk.skip(2 * 8, 8);
      walk.transforms();
      walk.transforms();
      break;
    case kState:
      walk.state();
      break;
    case kHistories:
      walk.sequence([&] {
        walk.skip(12 * 8, 8);
        walk.id();
      });
      break;
    case kCorrelated:
      walk.skip(4 * 8, 8);
      walk.transforms();
      walk.transforms();
      walk.sequence([&] { walk.correlation(); }, kMaxCorrelated);
      walk.sequence([&] { walk.correlation(); }, kMaxCorrelated);
      break;
    case kConsistencies:
      walk.sequence([&] {
        walk.skip(5 * 8, 8);
        walk.id();
      });
      break;
    case kJointInfos:
      walk.sequence([&] {
        walk.skip(7 * 8, 8);
        walk.skip(3, 1);
        walk.id();
        walk.id();
        walk.id();
        walk.numbers(1);
      });
      break;
    case kKnownFrames:
      walk.sequence([&] {
        walk.id();
        walk.id();
        walk.id();
      });
      break;
    default:;  // a reply of a later version, which is rejected by name
  }
  return walk.good();
}

bool well_formed_state(const std::uint8_t* data, std::size_t size) {
  CdrWalk walk(data, size);
  walk.state();
  return walk.good();
}

bool well_formed_update(const std::uint8_t* data, std::size_t size) {
  CdrWalk walk(data, size);
  walk.sequence([&] { walk.edge(); });
  walk.skip(8, 8);
  return walk.good();
}

bool well_formed_joints(const std::uint8_t* data, std::size_t size) {
  CdrWalk walk(data, size);
  walk.sequence([&] { walk.joint(); });
  walk.skip(8, 8);
  return walk.good();
}

bool well_formed_page(const std::uint8_t* data, std::size_t size) {
  CdrWalk walk(data, size);
  walk.id();
  walk.ulong();
  walk.skip(8, 8);
  walk.skip(8, 8);
  walk.sequence([&] {
    walk.skip(8, 8);
    walk.id();
    walk.id();
  });
  walk.sequence([&] {
    walk.skip(8, 8);
    walk.octet();
    walk.id();
    walk.id();
  });
  walk.sequence([&] {
    walk.skip(8, 8);
    walk.ulong();
  });
  walk.sequence([&] {
    walk.id();
    walk.id();
  });
  return walk.good();
}

bool well_formed_presence(const std::uint8_t* data, std::size_t size) {
  CdrWalk walk(data, size);
  walk.id();
  walk.skip(8, 8);
  walk.string(255);
  walk.ulong();
  walk.ulong();
  walk.ulong();
  walk.boolean();
  walk.sequence([&] {
    walk.skip(8, 8);
    walk.skip(8, 8);
    walk.octet();
    walk.id();
  });
  walk.skip(8, 8);
  walk.octet();
  walk.octet();
  walk.skip(2, 2);
  walk.skip(2, 2);
  walk.string(255);
  const std::uint32_t clocks = walk.ulong();
  if (clocks > 1) return false;
  if (clocks == 1) walk.skip(8, 8);
  return walk.good();
}

}  // namespace tfdude::fastdds
