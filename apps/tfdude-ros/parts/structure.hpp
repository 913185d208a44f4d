#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <unordered_map>
#include <vector>

#include "tfdude/client/node.hpp"

#include "../logic/tf_import.hpp"

namespace tfdude::ros {

/// Whose the frames are, in the domain of tf-dude, as far as this process knows. Keeps a copy of
/// the structure that it reads again after a change. Belongs to one thread, except for changed().
class Structure {
 public:
  /// @param node  outlives it
  explicit Structure(Node& node) : node_(node) {}

  /// The copy is no longer valid. Thread-safe.
  void changed() { stale_ = true; }

  /// For TfImport.
  [[nodiscard]] Holding holding(const std::string& id);

 private:
  void read();

  Node& node_;
  std::atomic<bool> stale_{true};
  std::unordered_map<std::string, std::string> owners_;  // by the frame's id
};

}  // namespace tfdude::ros
