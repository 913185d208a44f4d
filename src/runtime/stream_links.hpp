#pragma once

#include "runtime/member_runner.hpp"
#include "runtime/sender.hpp"
#include "runtime/structure.hpp"
#include "transport/port.hpp"

namespace tfdude {

/// The destinations of streams of edges.
[[nodiscard]] SenderLinks<Update> edge_links(Structure& structure, Transport& transport,
                                             MemberRunner& member);

/// The destinations of streams of joints.
[[nodiscard]] SenderLinks<JointUpdate> joint_links(Structure& structure, Transport& transport,
                                                   MemberRunner& member);

}  // namespace tfdude
