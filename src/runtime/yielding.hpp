#pragma once

#include <optional>

#include "runtime/deferred.hpp"
#include "runtime/member_runner.hpp"
#include "runtime/requests.hpp"
#include "runtime/structure.hpp"

namespace tfdude {

/// Yields frames to better claims, once it is certain that those are still valid: a claim may have
/// been withdrawn long ago by an owner whose pages are late. So a claim must persist after all
/// others have reported their epochs, and their structure up to those has come.
/// @par Thread safety  ask() and stop() are thread-safe, after start().
class Yielding {
 public:
  Yielding(Structure& structure, Requests& requests, MemberRunner& member, Milliseconds timeout)
      : structure_(structure), requests_(requests), member_(member), timeout_(timeout) {}
  ~Yielding() { stop(); }
  Yielding(const Yielding&) = delete;
  Yielding& operator=(const Yielding&) = delete;

  /// Call before the participant owns anything.
  void start();
  void stop();

  /// A yield may be pending.
  void ask() { thread_->ask(); }

 private:
  void yield();
  [[nodiscard]] bool catch_up();

  Structure& structure_;
  Requests& requests_;
  MemberRunner& member_;
  const Milliseconds timeout_;
  std::optional<Deferred> thread_;  // last: it uses the other members
};

}  // namespace tfdude
