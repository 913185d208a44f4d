#pragma once

#include "runtime/member_runner.hpp"
#include "runtime/sender.hpp"
#include "runtime/structure.hpp"
#include "transport/port.hpp"

namespace tfdude {

/// Where streams of edges go to, and how.
[[nodiscard]] SenderLinks<Update> edge_links(Structure& structure, Transport& transport,
                                             MemberRunner& member);

/// The same of joints.
[[nodiscard]] SenderLinks<JointUpdate> joint_links(Structure& structure, Transport& transport,
                                                   MemberRunner& member);

}  // namespace tfdude
