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
  kHistory = 9,
  kRevise = 10,
  kConsistency = 11,
  kJoints = 12,
  kJointStates = 13,
  kCorrelate = 14,
  kPartialUpdate = 15,
  kForget = 16,
  kProbe = 17,
  kFrames = 18,
  kDescription = 19,
  kLastRequestKind = kDescription
};

enum ReplyKind : std::uint8_t {
  kError = 1,
  kTransforms = 2,
  kDoneReply = 3,
  kStamped = 4,
  kState = 5,
  kHistories = 6,
  kCorrelated = 7,
  kConsistencies = 8,
  kJointInfos = 9,
  kAlive = 10,
  kKnownFrames = 11,
  kIncomplete = 12,
  kDescriptionPart = 13,
  kLastReplyKind = kDescriptionPart
};

}  // namespace tfdude::fastdds
