#include "structure.hpp"

namespace tfdude::ros {

void Structure::read() {
  if (!stale_.exchange(false)) return;
  const auto frames = node_.frames();
  if (!frames) {
    stale_ = true;
    return;
  }
  owners_.clear();
  for (const Frame& frame : *frames) owners_.emplace(frame.id, frame.partition);
}

Holding Structure::holding(const std::string& id) {
  read();
  const auto known = owners_.find(id);
  if (known != owners_.end()) {
    if (known->second == node_.partition()) return {Holding::Kind::kBridge};
    return {Holding::Kind::kOther, known->second};
  }
  // A frame may belong to a partition that stopped before this process started: then the others say
  // that they miss it.
  const auto parent = node_.parent(id);
  if (!parent && parent.error().code != Errc::kUnknownFrame) {
    return {Holding::Kind::kUnknown, parent.error().message};
  }
  if (!parent) return {Holding::Kind::kNobody};
  stale_ = true;  // it has just appeared
  return {Holding::Kind::kUnknown, "its owner is not known yet"};
}

}  // namespace tfdude::ros
