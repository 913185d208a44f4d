#pragma once

#include <string>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/networks.hpp"

// Owners of two frames each, P_base and P_tip.
namespace tfdude::testing {

[[nodiscard]] inline Node open_with_tip(const Join& join, const std::string& partition) {
  const std::string base = partition + "_base";
  return Node::open(join(partition), partition, {{base, "", {}}, {partition + "_tip", base, {}}})
      .value();
}

[[nodiscard]] inline bool is_at(Client& owner, const std::string& parent, const std::string& frame,
                                double x) {
  const auto X = owner.lookup(parent, frame);
  return X && X->pose.translation().x() == x;
}

}  // namespace tfdude::testing
