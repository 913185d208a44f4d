#pragma once

#include "runtime/context.hpp"

namespace tfdude {

/// Yields frames to better claims, once it is certain that those are still valid: a claim may have
/// been withdrawn long ago by an owner whose pages are late. So a claim must persist after all
/// others have reported their epochs, and their structure up to those has come.
/// @par Thread safety  All functions are thread-safe.
class Yielding {
 public:
  explicit Yielding(const Context& context);

  void stop() { yields_.stop(); }

  /// A yield may be pending.
  void ask() { yields_.ask(); }

 private:
  void yield();
  [[nodiscard]] bool catch_up();

  const Context context_;
  Loop::Job yields_;  // last: it uses the other members
};

}  // namespace tfdude
