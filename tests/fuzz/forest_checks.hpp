#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "fuzz/demand.hpp"
#include "tree/forest.hpp"

namespace tfdude::fuzz {

using Frames = std::map<std::string, FrameInfo>;

[[nodiscard]] inline Frames frames_of(const Forest& forest) {
  Frames frames;
  for (FrameInfo& frame : forest.frames()) {
    const std::string id = frame.id;
    demand(frames.emplace(id, std::move(frame)).second, "an id stands for one frame");
  }
  return frames;
}

/// The frame, its parent and so on, as far as they exist.
[[nodiscard]] inline std::vector<std::string> line_of(const Frames& frames, const std::string& id) {
  std::vector<std::string> line;
  for (auto at = frames.find(id); at != frames.end(); at = frames.find(at->second.parent)) {
    line.push_back(at->first);
    demand(line.size() <= frames.size(), "no frame lies below itself");
  }
  return line;
}

inline void demand_structure(const Forest& forest, const Frames& frames) {
  std::vector<std::string> roots;
  std::map<std::string, std::vector<std::string>> children;
  std::map<std::string, std::size_t> below;
  for (const auto& [id, frame] : frames) {
    const bool attached = frames.count(frame.parent) != 0;
    demand(frame.attached == attached, "a frame is attached where its parent is there");
    if (attached) {
      children[frame.parent].push_back(id);
    } else {
      roots.push_back(id);
    }
    for (const std::string& above : line_of(frames, id)) ++below[above];
  }
  demand(forest.roots() == roots, "roots are the frames that are not attached");
  for (const auto& [id, frame] : frames) {
    const auto listed = forest.children(id);
    demand(listed && *listed == children[id], "children are those who name their parent");
    demand(forest.subtree(id).size() == below[id], "a subtree is all that lies below");
    demand(forest.holds(id) == (frame.owner == kHeldHere), "held is what has no other owner");
    demand(forest.value(id).has_value() == (frame.owner == kHeldHere), "what is held has a value");
  }
}

inline void demand_paths(const Forest& forest, const Frames& frames) {
  for (const auto& a : frames) {
    for (const auto& b : frames) {
      const bool connected = line_of(frames, a.first).back() == line_of(frames, b.first).back();
      const auto path = forest.segments(a.first, b.first);
      demand(path.has_value() == connected, "there is a path where there is a common root");
      const auto X_AB = forest.lookup(a.first, b.first);
      if (!path) {
        demand(!X_AB, "there is no value without a path");
        continue;
      }
      std::string at = a.first;
      bool held = true;
      for (const Segment& segment : *path) {
        demand(segment.from == at, "segments follow each other");
        at = segment.to;
        held = held && segment.owner == kHeldHere;
      }
      demand(at == b.first, "a path ends where it is to");
      demand(X_AB.has_value() == held, "there is a value where all of the path is held");
    }
  }
}

/// Checks that all functions of a forest report the same frames, without a cycle.
inline void demand_consistent(const Forest& forest) {
  const Frames frames = frames_of(forest);
  demand_structure(forest, frames);
  demand_paths(forest, frames);
}

}  // namespace tfdude::fuzz
