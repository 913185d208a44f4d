#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "partition/routing.hpp"
#include "partition/watching.hpp"
#include "runtime/missing_samples.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// The edges of a watched path, and the owners that push them.
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

  /// Whether it has the same edges with the same owners.
  [[nodiscard]] bool is_same(const WatchRoute& other) const;
};

/// The route of the path from a to b in the current structure, with single edges or `composed`.
/// @param own_incarnation  of the requesting process's partition
/// @return as route_watch()
[[nodiscard]] Result<WatchRoute> watch_route(const Forest& forest, const Directory& directory,
                                             const std::string& a, const std::string& b,
                                             bool composed, std::chrono::nanoseconds period,
                                             std::uint64_t own_incarnation);

/// The route of the edges of these frames, wherever they are. @return as route_watch_edges()
[[nodiscard]] Result<WatchRoute> watch_route(const Forest& forest, const Directory& directory,
                                             const std::vector<std::string>& ids,
                                             std::chrono::nanoseconds period,
                                             std::uint64_t own_incarnation);

/// The values that owners have pushed for one route: a forest of its edges. A value belongs to its
/// edge by its group, which is specific to this route. Only the newest history of an edge is shown.
/// A commit of an owner is one commit here.
/// @par Thread safety  lookup() is thread-safe, without a lock; of the others one at a time.
class WatchMirror {
 public:
  /// @param a, b  the ends of the path; empty for edges that are no path
  /// @param timing  how much history is kept
  WatchMirror(const std::string& a, const std::string& b, WatchRoute route,
              const EdgeTiming& timing);

  /// As Forest::lookup().
  [[nodiscard]] Result<StampedTransform> lookup(const Query& query) const {
    return forest_.lookup(a_, b_, query);
  }
  [[nodiscard]] Result<StampedTransform> lookup(std::string_view a, std::string_view b,
                                                const Query& query) const {
    return forest_.lookup(a, b, query);
  }

  /// The stamps of an edge's samples after an instant, in order.
  [[nodiscard]] std::vector<Time> stamps(std::string_view id, Time after) const;

  [[nodiscard]] const WatchRoute& route() const { return route_; }

  /// Whether values of this group belong to it.
  [[nodiscard]] bool has(std::uint64_t group) const;

  /// Copies another mirror's values of common edges, so that their history continues. Call before
  /// anything is taken.
  void inherit(const WatchMirror& before);

  /// Applies values from an owner. @return whether any of them is new here
  bool take(const PushedValues& pushed);

  /// Whether all edges have their values.
  [[nodiscard]] bool complete() const;

  /// Whether a message was lost, or has come before an earlier one: then all values must be
  /// requested.
  [[nodiscard]] bool lacks() const;

  /// Whether the other mirror has newer data of an owner common to both.
  [[nodiscard]] bool is_behind(const WatchMirror& other) const;

  /// The newest instant that all dynamic edges have reached, if one of them has no sample at or
  /// before it: its owner may have an earlier one.
  [[nodiscard]] std::optional<Time> lacks_history() const;

  /// The instant after which answers have left samples out, as an answer tells only the newest ones
  /// unless it is asked for more: messages were lost before it, or come after it.
  [[nodiscard]] std::optional<Time> skipped_from() const { return skipped_.from(); }
  /// As skipped_from(), for a request that follows.
  [[nodiscard]] std::optional<Time> ask_for_skipped() { return skipped_.ask(); }
  /// All owners have answered a request for all samples from this instant on.
  void told_from(Time from) { skipped_.told(from); }

 private:
  struct Edge {
    std::uint64_t history = 0;   // the owner's number; 0: unknown
    std::uint64_t commit = 0;    // as of which pushes have told it
    std::uint64_t answered = 0;  // as of which an answer has, from that stamp on:
    Time answered_from;
    Correlation said;              // as of the later of both
    std::optional<Time> newest;    // of its samples
    std::optional<Time> complete;  // up to which none is missing
    std::size_t source = 0;
  };
  struct Source {
    std::vector<std::uint32_t> edges;  // by the entries' indices
    ReceivedGroup received;
  };

  struct Message {
    std::uint64_t commit = 0;
    bool follows_on = false;  // nothing is missing before it
  };
  struct Admitted {
    std::vector<PushedValue> values;
    std::vector<PushedValue> missed;  // samples of before, unless there is one of their stamp
  };

  /// Adds the entry, unless it is old or must wait.
  void admit(const Source& source, PushedValue entry, const Message& message, Admitted& admitted);
  void note_skipped(const Source& source, const PushedValues& answer);
  void note_told(const PushedValues& message, bool follows_on,
                 const std::vector<PushedValue>& values);
  [[nodiscard]] const Source* source_like(const WatchRoute::Source& source) const;

  WatchRoute route_;
  Forest forest_;
  Handle a_;
  Handle b_;
  std::vector<Handle> handles_;  // by edge, as the others
  std::vector<Edge> edges_;
  std::vector<Source> sources_;
  MissingSamples skipped_;
};

}  // namespace tfdude
