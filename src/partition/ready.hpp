#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tfdude/types/change.hpp"

#include "partition/directory.hpp"
#include "partition/messages.hpp"
#include "partition/state_store.hpp"

namespace tfdude {

/// The reply to a request that may have changed something.
struct PendingReply {
  PeerId to{};
  Reply reply{};
  std::string what{};  ///< for the log; empty: nothing to log
};

/// The actions that a member requires, in this order: store, publish, announce, reply. So nobody
/// hears of a change that could be lost.
struct Ready {
  StateChange rows{};                   ///< to store before anything is announced
  std::vector<Page> pages{};            ///< to publish after storing
  std::optional<Presence> presence{};   ///< to announce after the pages
  std::vector<PendingReply> replies{};  ///< to send at the end
  /// Why nothing of it is valid any more: nothing is stored, and whoever waits for a reply gets
  /// this error.
  std::optional<Error> refused{};
};

/// The immediate effects of an input on this process itself, independent of what others hear.
struct Outcome {
  std::vector<Change> events{};  ///< in order; without times
  std::vector<Directory::Outdated> outdated{};
  std::vector<std::string> cut{};           ///< partitions of which not everything is kept
  std::optional<Presence> appeared{};       ///< a partition that is served now
  std::optional<Presence> stopped{};        ///< a partition that announced its stop
  std::optional<std::string> lost{};        ///< a partition that no longer sends
  std::optional<Presence> rival{};          ///< another process that serves the own partition
  std::optional<std::uint64_t> overtook{};  ///< the incarnation as which this process continues
  bool gave_up = false;                     ///< the own partition was given up, to the rival
  bool heard = false;                       ///< a message of others was processed
  /// What a plan would find has changed: frames, their owners, or which partitions are reachable.
  bool routes = false;
  bool to_commit = false;      ///< take_ready() should be called soon, as there may be changes
  bool to_reply = false;       ///< take_ready() should be called at once, as a reply is due
  bool to_yield = false;       ///< a yield may be pending
  bool look_for_gone = false;  ///< a partition is silent: call on_time()
};

}  // namespace tfdude
