#pragma once

#include <optional>
#include <string>
#include <vector>

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

/// Those of a Client, or of a Node, which follows all frames.
struct ParticipantOptions : NodeOptions {
  // NOLINTBEGIN(google-explicit-constructor): each of them says all
  ParticipantOptions(const Options& common) : NodeOptions(common) {}
  ParticipantOptions(const NodeOptions& node) : NodeOptions(node) {}
  ParticipantOptions(const ClientOptions& client)
      : NodeOptions(static_cast<const Options&>(client)), follow(client.follow) {}
  // NOLINTEND(google-explicit-constructor)

  std::optional<std::vector<std::string>> follow{};  ///< as of ClientOptions
};

/// What the parts of a participant need of it. All of it outlives them.
struct Context {
  const ParticipantOptions& options;
  Structure& structure;
  Transport& transport;
  Discovery& discovery;
  MemberRunner& member;
  Requests& requests;
  Threads& threads;
};

}  // namespace tfdude
