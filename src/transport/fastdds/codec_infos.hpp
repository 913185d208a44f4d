#pragma once

#include "partition/messages.hpp"
#include "transport/fastdds/compat.hpp"

// Converts what owners report of their edges and joints from the network. Names are for people to
// read: whatever a sender has put into them can be shown.
namespace tfdude::fastdds {

[[nodiscard]] EdgeConsistency read_consistency(const wire::EdgeConsistency& body);
[[nodiscard]] JointInfo read_joint(const wire::JointState& body);
[[nodiscard]] HistoryInfo read_history(const wire::HistoryInfo& body);

}  // namespace tfdude::fastdds
