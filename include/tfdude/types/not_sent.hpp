#pragma once

#include <cstddef>
#include <string_view>

#include "tfdude/base/result.hpp"

namespace tfdude {

/// An edge or joint that try_publish() did not send, or not to all its owners.
struct NotSent {
  std::size_t index = 0;  ///< position in the list that the stream was opened with
  /// - kUnknownFrame, kUnknownJoint: this process knows no owner (yet).
  /// - kAmbiguousJoint: several partitions have a joint of that name: open it as PARTITION/JOINT.
  /// - kUnreachable: the owner is known to be down.
  /// - kTimeout: the owner was not discovered yet, or cannot be sent the value at once.
  /// - kNotPermitted: the keys of this process do not allow it.
  /// - kInvalidInput: not a number, out of range, or not one value per edge or joint.
  /// - kPartitionTaken: this Node has lost its partition.
  /// - kTransport: the Client was destroyed.
  /// For edges and joints of this process also the errors of update() and update_joints().
  Errc why = Errc::kTimeout;
  /// The owner; empty if there is none. Valid until the next call, and until the Client is
  /// destroyed.
  std::string_view partition;
};

}  // namespace tfdude
