#pragma once

#include <cstddef>
#include <string_view>

#include "tfdude/base/result.hpp"

namespace tfdude {

/// An edge or joint that try_publish() did not send, or not to all who have it.
struct NotSent {
  std::size_t index = 0;  ///< among those that the stream was opened with
  /// kUnknownFrame, kUnknownJoint: nobody is known here to have it (yet). kUnreachable: its owner is known to be down.
  /// kTimeout: the owner was not met yet, or cannot take it at once. kInvalidInput: not a number, out of range, or not as many
  /// values as edges or joints. kPartitionTaken: this Node has lost its partition. kTransport: the Client has gone. Of what this
  /// process owns itself also what update() and update_joints() refuse.
  Errc why = Errc::kTimeout;
  /// The owner; empty where there is none. Until the next call, and the end of the Client.
  std::string_view partition;
};

}  // namespace tfdude
