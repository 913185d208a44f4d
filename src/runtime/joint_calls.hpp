#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "runtime/member_runner.hpp"
#include "runtime/requests.hpp"
#include "runtime/structure.hpp"

namespace tfdude {

/// Positions of joints: to who has them, and from others; and what is known of them. What each returns is said at Client.
/// @par Thread safety  All functions.
class JointCalls {
 public:
  JointCalls(Structure& structure, Discovery& discovery, Requests& requests, MemberRunner& member)
      : structure_(structure), discovery_(discovery), requests_(requests), member_(member) {}

  [[nodiscard]] Result<void> update(const JointUpdate& update);
  [[nodiscard]] Result<void> publish(const JointUpdate& update);
  [[nodiscard]] Result<std::vector<JointInfo>> list(const std::string& partition);

  /// What somebody has published. Where it is refused, that is counted and logged.
  void on_joints(const JointUpdate& update);

 private:
  Structure& structure_;
  Discovery& discovery_;
  Requests& requests_;
  MemberRunner& member_;
  std::atomic<std::uint64_t> refused_{0};  // updates
};

}  // namespace tfdude
