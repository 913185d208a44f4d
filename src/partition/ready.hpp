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

/// What is to be done because of what a member was told, in this order: stored, published, announced, replied. So nobody
/// hears of what could be lost.
struct Ready {
  StateChange rows{};                   ///< stored before anything of it is told
  std::vector<Page> pages{};            ///< published once that is done,
  std::optional<Presence> presence{};   ///< announced after them,
  std::vector<PendingReply> replies{};  ///< and then these are sent
  /// Why none of it counts any more: nothing is stored, and whoever waits for a reply is told so.
  std::optional<Error> refused{};
};

/// What an input has changed for this process itself, at once: what it sees is not what others hear.
struct Outcome {
  std::vector<Change> events{};  ///< in the order in which they happened; without times
  std::vector<Directory::Outdated> outdated{};
  std::optional<Presence> appeared{};       ///< a partition that is served now,
  std::optional<Presence> stopped{};        ///< that has said that it ends,
  std::optional<std::string> lost{};        ///< that is not heard any more
  std::optional<Presence> rival{};          ///< another process that serves the own partition
  std::optional<std::uint64_t> overtook{};  ///< the incarnation as which this process goes on
  bool gave_up = false;                     ///< the own partition, to the rival
  bool heard = false;                       ///< something of others
  bool others = false;                      ///< other partitions are there, or not any more
  bool routes = false;                      ///< frames are elsewhere, or with others
  bool to_commit = false;      ///< there may be something to take by take_ready(), soon,
  bool to_reply = false;       ///< or at once, as somebody waits for a reply
  bool to_yield = false;       ///< a yield may be pending
  bool look_for_gone = false;  ///< somebody is silent: on_time() is to be called
};

}  // namespace tfdude
