#pragma once

#include <optional>

#include "runtime/deferred.hpp"
#include "runtime/member_runner.hpp"
#include "runtime/requests.hpp"
#include "runtime/structure.hpp"

namespace tfdude {

/// Yields frames that others have a better claim to, once it is sure that the claim still stands: a claim may have been
/// taken back long ago by an owner whose pages are late. So what is yielded must stand after all of the others have told how
/// far they are, and their structure up to there has come.
/// @par Thread safety  ask() and stop(), after start().
class Yielding {
 public:
  Yielding(Structure& structure, Requests& requests, MemberRunner& member, Milliseconds timeout)
      : structure_(structure), requests_(requests), member_(member), timeout_(timeout) {}
  ~Yielding() { stop(); }
  Yielding(const Yielding&) = delete;
  Yielding& operator=(const Yielding&) = delete;

  /// Before the participant owns anything.
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
  std::optional<Deferred> thread_;  // last: it uses the rest
};

}  // namespace tfdude
