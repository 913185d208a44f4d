#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "runtime/member_runner.hpp"
#include "runtime/requests.hpp"
#include "runtime/structure.hpp"
#include "transport/port.hpp"

namespace tfdude {

/// Positions of joints: to who has them, and from others; and what is known of them. What each returns is said at Client.
/// @par Thread safety  All functions.
class JointCalls {
 public:
  JointCalls(Structure& structure, Discovery& discovery, Requests& requests, Transport& transport,
             MemberRunner& member)
      : structure_(structure),
        discovery_(discovery),
        requests_(requests),
        transport_(transport),
        member_(member) {}

  [[nodiscard]] Result<void> update(const JointUpdate& update);
  [[nodiscard]] Result<void> publish(const JointUpdate& update);
  [[nodiscard]] Result<std::vector<JointInfo>> list(const std::string& partition);

  /// What somebody has published. Where it is refused, that is counted and logged.
  void on_joints(const JointUpdate& update);

 private:
  [[nodiscard]] Result<void> publish_to(const Part& part, const Deadline& deadline);

  Structure& structure_;
  Discovery& discovery_;
  Requests& requests_;
  Transport& transport_;
  MemberRunner& member_;
  std::atomic<std::uint64_t> refused_{0};  // updates
};

}  // namespace tfdude
