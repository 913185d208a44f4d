#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <tl/expected.hpp>

#include "tfdude/base/export.hpp"
#include "tfdude/base/time.hpp"

namespace tfdude {

/// Kinds of errors, by what a caller can do about them. The numbers are sent over the network:
/// never reuse one.
enum class Errc : std::uint8_t {
  kInvalidInput = 1,       ///< a field breaks its rule; the message names the field
  kUnknownFrame = 2,       ///< no frame of that id
  kUnknownStart = 3,       ///< lookup: no frame of the first id
  kUnknownEnd = 4,         ///< lookup: no frame of the second id
  kUnknownParent = 5,      ///< add, move: no frame of the parent's id
  kUnknownPartition = 6,   ///< no partition of that name
  kAlreadyExists = 7,      ///< add: the id is taken
  kNotConnected = 8,       ///< lookup: the frames have no common root
  kCycle = 9,              ///< move: the new parent lies below the frame
  kNotOwner = 10,          ///< the partition asked does not own the edge now; retry
  kPartitionTaken = 11,    ///< another live daemon serves a partition of this name
  kUnreachable = 12,       ///< the owner is known to be down
  kTimeout = 13,           ///< the owner did not answer in time
  kConfig = 14,            ///< a file (configuration, profile) is missing or invalid
  kTransport = 15,         ///< the transport could not be set up
  kState = 16,             ///< the stored state of a partition could not be read or written
  kNotYet = 17,            ///< an edge has no data for that instant yet
  kTooOld = 18,            ///< an edge no longer has data for that instant
  kStampTaken = 19,        ///< update: the edge has another sample of that stamp
  kChangedMeanwhile = 20,  ///< observe: an edge was written while it was observed
  kUnknownJoint = 21,      ///< no joint of that name
  kIncompatible = 22,      ///< a participant speaks another major version of the protocol
  kUnsupported = 23,       ///< an earlier version does not know what was sent to it
  kNotPermitted = 24,      ///< the keys of this participant, or the lack of keys, do not allow it
  kTooMuch = 25,           ///< a limit of the partition is reached; the message names it
  kAmbiguousJoint = 26,    ///< several partitions have a joint of that name: say PARTITION/JOINT
};

/// The stable snake_case name of a code, as the command line prints it in JSON.
[[nodiscard]] TFDUDE_EXPORT std::string_view to_string(Errc code);

/// Whether the code says that something does not exist.
[[nodiscard]] TFDUDE_EXPORT bool is_unknown(Errc code);

/// The instants from one to another, both included.
struct Interval {
  Time from{};
  Time until{};

  friend bool operator==(const Interval& a, const Interval& b) {
    return a.from == b.from && a.until == b.until;
  }
};

/// An error for people: the message names the frame, the partition and the value concerned. Errors
/// of lookups also have these as data.
struct Error {
  Errc code{};
  std::string message;
  std::string frame{};      ///< that is missing, or whose edge is the cause; empty: see the message
  std::string partition{};  ///< that is missing, does not answer, or has answered; empty: not known
  /// kNotYet, kTooOld: when all dynamic edges have data. Absent if they have no instant in common,
  /// or if another process has answered by a message, whose text says it.
  std::optional<Interval> available{};
};

template <class T>
using Result = tl::expected<T, Error>;

/// Builds the failing side of any Result.
[[nodiscard]] inline tl::unexpected<Error> fail(Errc code, std::string message) {
  return tl::unexpected<Error>(Error{code, std::move(message)});
}

/// The same, about a frame or a partition.
[[nodiscard]] inline tl::unexpected<Error> fail_about_frame(Errc code, std::string message,
                                                            std::string_view frame) {
  return tl::unexpected<Error>(Error{code, std::move(message), std::string(frame)});
}
[[nodiscard]] inline tl::unexpected<Error> fail_about_partition(Errc code, std::string message,
                                                                std::string_view partition) {
  return tl::unexpected<Error>(Error{code, std::move(message), {}, std::string(partition)});
}

/// An error that came as a text: names the first frame and the first partition of the text.
[[nodiscard]] TFDUDE_EXPORT Error error_of_text(Errc code, std::string message);

/// Prefixes the error with the place where it happened: "frame 'arm_1': stddev[2]: ...".
[[nodiscard]] inline tl::unexpected<Error> fail_at(const std::string& place, Error error) {
  error.message.insert(0, place + ": ");
  return tl::unexpected<Error>(std::move(error));
}

}  // namespace tfdude
