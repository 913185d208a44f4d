#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "runtime/context.hpp"
#include "runtime/member_runner.hpp"
#include "runtime/requests.hpp"

namespace tfdude {

/// Sends joint positions to their owners, applies those of others, and reports the state of joints.
/// Client describes the return values.
/// @par Thread safety  All functions are thread-safe.
class JointCalls {
 public:
  explicit JointCalls(const Context& context)
      : structure_(context.structure),
        discovery_(context.discovery),
        requests_(context.requests),
        member_(context.member) {}

  [[nodiscard]] Result<void> update(const JointUpdate& update);
  [[nodiscard]] Result<void> publish(const JointUpdate& update);
  [[nodiscard]] Result<std::vector<JointInfo>> list(const std::string& partition) {
    return list(partition, discovery_.call_deadline());
  }
  [[nodiscard]] Result<std::vector<JointInfo>> list(const std::string& partition,
                                                    const Deadline& deadline);

  /// Applies published positions. Rejected ones are counted and logged.
  void on_joints(const JointUpdate& update);

 private:
  Structure& structure_;
  Discovery& discovery_;
  Requests& requests_;
  MemberRunner& member_;
  std::atomic<std::uint64_t> refused_{0};  // updates
};

}  // namespace tfdude
