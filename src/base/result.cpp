#include "tfdude/base/result.hpp"

#include <cctype>
#include <initializer_list>

namespace tfdude {
namespace {

// What stands in quotes after the first of these words.
std::string named_after(std::initializer_list<std::string_view> words, std::string_view text) {
  std::size_t first = text.size();
  std::size_t begin = first;
  for (const std::string_view word : words) {
    for (std::size_t at = text.find(word); at < first; at = text.find(word, at + 1)) {
      if (at > 0 && std::isalnum(static_cast<unsigned char>(text[at - 1])) != 0) continue;
      first = at;
      begin = at + word.size();
    }
  }
  const std::size_t end = text.find('\'', begin);
  return end == std::string_view::npos ? "" : std::string(text.substr(begin, end - begin));
}

}  // namespace

Error error_of_text(Errc code, std::string message) {
  Error error{code, {}};
  error.frame = named_after({"frame '", "frames '", "edge of '"}, message);
  error.partition = named_after({"partition '"}, message);
  error.message = std::move(message);
  return error;
}

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
