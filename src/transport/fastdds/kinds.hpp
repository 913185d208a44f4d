#pragma once

#include <cstdint>

namespace tfdude::fastdds {

// The discriminators of wire::RequestBody and wire::ReplyBody.
enum RequestKind : std::uint8_t {
  kAdd = 1,
  kRemove = 2,
  kUpdate = 3,
  kMove = 4,
  kMoveAndUpdate = 5,
  kLookup = 6,
  kLookupAt = 7,
  kWatch = 8,
  kPast = 9,
  kRevise = 10,
  kConsistency = 11,
  kJoints = 12,
  kJointStates = 13,
  kCorrelate = 14,
  kPartialUpdate = 17,
  kForget = 20
};
enum ReplyKind : std::uint8_t {
  kError = 1,
  kTransforms = 2,
  kDoneReply = 3,
  kStamped = 4,
  kState = 5,
  kPasts = 6,
  kTied = 7,
  kConsistencies = 8,
  kJointInfos = 9
};

}  // namespace tfdude::fastdds
