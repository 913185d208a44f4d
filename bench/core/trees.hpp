#pragma once

#include <string>
#include <vector>

#include <tf2/buffer_core.h>

#include "tfdude/client/client.hpp"

#include "support/random.hpp"
#include "support/tf2_message.hpp"

namespace bench {

/// A path of `depth` edges, up one branch to the root and down another, in a tree of `frames`
/// frames.
struct Tree {
  std::vector<tfdude::FrameSpec> frames;
  std::string from;
  std::string to;
};

inline Tree up_down_tree(std::size_t depth, std::size_t frames) {
  tfdude::testing::Random random(7);
  Tree tree;
  tree.frames.push_back({"frame_0", "", {}});
  const auto grow = [&](const std::string& parent) {
    const std::string id = "frame_" + std::to_string(tree.frames.size());
    tree.frames.push_back({id, parent, random.transform()});
    return id;
  };
  tree.from = tree.to = "frame_0";
  for (std::size_t i = 0; i < depth / 2; ++i) tree.from = grow(tree.from);
  for (std::size_t i = depth / 2; i < depth; ++i) tree.to = grow(tree.to);
  while (tree.frames.size() < frames) grow(tree.frames[random.index(tree.frames.size())].id);
  return tree;
}

/// The same edge for tf2, which keeps no covariance.
inline geometry_msgs::TransformStamped stamped(const tfdude::FrameSpec& frame, ros::Time at) {
  return tfdude::testing::tf2_message(frame.parent, frame.id, frame.X_PC.pose, at);
}

/// The same tree in tf-dude and in tf2, each edge with one value.
inline void fill(tf2::BufferCore& buffer, const Tree& tree) {
  for (const auto& frame : tree.frames) {
    if (!frame.parent.empty()) buffer.setTransform(stamped(frame, ros::Time(1)), "bench", false);
  }
}

}  // namespace bench
