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

/// The threads on which the parts of a participant run things later, besides that of CommitLoop.
/// docs/architecture.md lists all threads.
struct Threads {
  Loop calls{"tfdude-calls"};  ///< for jobs that wait for nobody
  Loop push{"tfdude-push"};    ///< for pushing to watchers
  Loop asking{"tfdude-ask"};   ///< for jobs that wait for the replies of others
  Callbacks callbacks{calls};
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
