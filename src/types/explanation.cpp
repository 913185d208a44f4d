#include "tfdude/types/explanation.hpp"

#include "tfdude/base/id.hpp"

namespace tfdude {

std::string clock_hint(const std::string& partition, std::chrono::nanoseconds ahead) {
  return "the clock of partition " + quote(partition) + " is " + readable(std::chrono::abs(ahead)) +
         (ahead.count() < 0 ? " behind" : " ahead of") + " the one here";
}

const char* to_string(Obstacle obstacle) {
  switch (obstacle) {
    case Obstacle::kUnknownFrame:
      return "unknown_frame";
    case Obstacle::kMissingParent:
      return "missing_parent";
    case Obstacle::kNotConnected:
      return "not_connected";
    case Obstacle::kOwnerLost:
      return "owner_lost";
    case Obstacle::kOwnerStopped:
      return "owner_stopped";
    case Obstacle::kOwnerSilent:
      return "owner_silent";
    case Obstacle::kNoSample:
      return "no_sample";
    case Obstacle::kEndsBefore:
      return "ends_before";
    case Obstacle::kBeginsAfter:
      return "begins_after";
    case Obstacle::kNoCommonInstant:
      return "no_common_instant";
    case Obstacle::kOtherClock:
      return "other_clock";
    case Obstacle::kNobody:
      return "nobody";
    case Obstacle::kOther:
      break;
  }
  return "other";
}

}  // namespace tfdude
