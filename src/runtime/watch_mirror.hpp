#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "partition/routing.hpp"
#include "partition/watching.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// How a watched path lies, and who sends it.
struct WatchRoute {
  /// A part of the path that one owner pushes.
  struct Source {
    std::string partition;
    std::uint64_t incarnation = 0;
    std::uint64_t group = 0;
    std::vector<std::string> frames;  ///< the edges' children, by the entries' indices
  };
  std::vector<FrameInfo> edges;
  std::vector<Source> sources;
  std::vector<Part> parts;  ///< a WatchRequest for each source

  /// Whether it has the same edges of the same owners.
  [[nodiscard]] bool is_same(const WatchRoute& other) const;
};

/// The route of the path from a to b as the structure is now, each edge alone or `composed`.
/// @param own_incarnation  of the partition's process that asks
/// @return as route_watch
[[nodiscard]] Result<WatchRoute> watch_route(const Forest& forest, const Directory& directory,
                                             const std::string& a, const std::string& b,
                                             bool composed, std::chrono::nanoseconds period,
                                             std::uint64_t own_incarnation);

/// What owners have told of one route: a forest of its edges, written as they push them. A value belongs to its edge by
/// its group, which is of this route; of an edge's histories the newest is shown; what an owner wrote as one commit is
/// one here.
/// @par Thread safety  lookup(), without a lock; of the rest one function at a time.
class WatchMirror {
 public:
  /// @param timing  how long a history is kept
  WatchMirror(const std::string& a, const std::string& b, WatchRoute route,
              const EdgeTiming& timing);
  WatchMirror(const WatchMirror&) = delete;
  WatchMirror& operator=(const WatchMirror&) = delete;

  /// As Forest::lookup().
  [[nodiscard]] Result<StampedTransform> lookup(const Query& query) const {
    return forest_.lookup(a_, b_, query);
  }

  [[nodiscard]] const WatchRoute& route() const { return route_; }

  /// What another mirror knows of edges that are here, too: so their history goes on. To be called before anything is taken.
  void inherit(const WatchMirror& before);

  /// What an owner told. @return whether something of it is new here
  bool take(const PushedValues& pushed);

  /// Whether all edges have their values.
  [[nodiscard]] bool complete() const;

  /// Whether something was lost on its way, or has come before what it builds on: then all must be asked for.
  [[nodiscard]] bool lacks() const;

  /// Whether the other one has heard later of an owner that both hear.
  [[nodiscard]] bool is_behind(const WatchMirror& other) const;

  /// The newest instant that all moving edges have reached, where one of them has no sample that is not younger: its
  /// owner may know where it was then.
  [[nodiscard]] std::optional<Time> lacks_history() const;

 private:
  struct Edge {
    std::uint64_t history = 0;   // the owner's number; 0: nothing is known
    std::optional<Time> newest;  // of its samples
    std::size_t source = 0;
  };
  struct Source {
    std::vector<std::uint32_t> edges;  // by the entries' indices
    PushedPieces pieces;
    std::uint64_t commit = 0;  // of the owner's: all until then is here; 0: nothing yet
    std::uint64_t heard = 0;   // the newest commit of which something came
  };

  /// The entry as the mirror is to take it, unless it is old or must wait.
  [[nodiscard]] std::optional<PushedValue> admitted(const Source& source, PushedValue entry,
                                                    bool follows_on);
  [[nodiscard]] const Source* source_like(const WatchRoute::Source& source) const;

  WatchRoute route_;
  Forest forest_;
  Handle a_;
  Handle b_;
  std::vector<Handle> handles_;  // by edge, as the rest
  std::vector<Edge> edges_;
  std::vector<Source> sources_;
};

}  // namespace tfdude
