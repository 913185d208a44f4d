#include "transport/fastdds/cdr_check.hpp"

#include "partition/messages.hpp"
#include "transport/fastdds/kinds.hpp"

namespace tfdude::fastdds {
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
    case kDescription:
      walk.skip(8, 8);
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
      walk.correlated_transforms();
      break;
    case kIncomplete:
      walk.correlated_transforms();
      walk.unspecified_edges();
      walk.unspecified_edges();
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
    case kDescriptionPart:
      walk.skip(2 * 8, 8);
      walk.string(kMaxDescriptionPart);
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

bool well_formed_clock(const std::uint8_t* data, std::size_t size) {
  CdrWalk walk(data, size);
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
