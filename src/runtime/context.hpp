#pragma once

#include "tfdude/types/options.hpp"

#include "base/loop.hpp"
#include "runtime/callbacks.hpp"
#include "runtime/discovery.hpp"
#include "runtime/structure.hpp"
#include "transport/port.hpp"

namespace tfdude {

class MemberRunner;
class Requests;

/// The threads of a participant on which its parts run things later, besides those of CommitLoop
/// and PendingLookups. docs/architecture.md lists all threads.
struct Threads {
  Loop prompt{"tfdude-push"};  ///< for jobs that wait for nobody
  Loop asking{"tfdude-ask"};   ///< for jobs that wait for the replies of others
  Callbacks callbacks{prompt};
};

/// What the parts of a participant need of it. All of it outlives them.
struct Context {
  const Options& options;
  Structure& structure;
  Transport& transport;
  Discovery& discovery;
  MemberRunner& member;
  Requests& requests;
  Threads& threads;
};

}  // namespace tfdude
