#include "tfdude/base/result.hpp"

namespace tfdude {

std::string_view to_string(Errc code) {
  switch (code) {
    case Errc::kInvalidInput:
      return "invalid_input";
    case Errc::kUnknownFrame:
      return "unknown_frame";
    case Errc::kUnknownStart:
      return "unknown_start";
    case Errc::kUnknownEnd:
      return "unknown_end";
    case Errc::kUnknownParent:
      return "unknown_parent";
    case Errc::kUnknownPartition:
      return "unknown_partition";
    case Errc::kAlreadyExists:
      return "already_exists";
    case Errc::kNotConnected:
      return "not_connected";
    case Errc::kCycle:
      return "cycle";
    case Errc::kNotOwner:
      return "not_owner";
    case Errc::kPartitionTaken:
      return "partition_taken";
    case Errc::kUnreachable:
      return "unreachable";
    case Errc::kTimeout:
      return "timeout";
    case Errc::kConfig:
      return "config";
    case Errc::kTransport:
      return "transport";
    case Errc::kState:
      return "state";
    case Errc::kNotYet:
      return "not_yet";
    case Errc::kTooOld:
      return "too_old";
    case Errc::kStampTaken:
      return "stamp_taken";
    case Errc::kUnknownJoint:
      return "unknown_joint";
    case Errc::kChangedMeanwhile:
      return "changed_meanwhile";
    case Errc::kIncompatible:
      return "incompatible";
    case Errc::kUnsupported:
      return "unsupported";
    case Errc::kNotPermitted:
      return "not_permitted";
    case Errc::kTooMuch:
      return "too_much";
    case Errc::kAmbiguousJoint:
      return "ambiguous_joint";
  }
  return "unknown";
}

bool is_unknown(Errc code) {
  switch (code) {
    case Errc::kUnknownFrame:
    case Errc::kUnknownStart:
    case Errc::kUnknownEnd:
    case Errc::kUnknownParent:
    case Errc::kUnknownPartition:
    case Errc::kUnknownJoint:
      return true;
    default:
      return false;
  }
}

}  // namespace tfdude
