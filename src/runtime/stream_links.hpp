#pragma once

#include <memory>

#include "runtime/context.hpp"
#include "runtime/sender.hpp"

namespace tfdude {

/// The destinations of streams of edges.
[[nodiscard]] std::shared_ptr<SenderLinks<Update>> edge_links(const Context& context);

/// The destinations of streams of joints.
[[nodiscard]] std::shared_ptr<SenderLinks<JointUpdate>> joint_links(const Context& context);

}  // namespace tfdude
