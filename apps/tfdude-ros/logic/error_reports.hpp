#pragma once

#include <cstddef>
#include <set>
#include <string>

#include "tfdude/base/result.hpp"

namespace tfdude::ros {

/// Decides which errors go into the log: each once, and again after succeeded(). What an edge has
/// no data for is told once for each edge, since the instants differ with each message.
class ErrorReports {
 public:
  /// Whether it is to be told.
  [[nodiscard]] bool is_new(const Error& error);
  void succeeded() { told_.clear(); }
  /// Of one edge, or one that always has the same: what it lacked data for is told again, too.
  void has_data() {
    told_.clear();
    without_data_.clear();
  }

 private:
  // What happens after that is only counted.
  static constexpr std::size_t kMost = 1000;

  std::set<std::string> told_;
  std::set<std::string> without_data_;
};

}  // namespace tfdude::ros
