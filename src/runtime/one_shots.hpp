#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "memory/one_shot_socket.hpp"
#include "runtime/context.hpp"
#include "runtime/memory_reads.hpp"

namespace tfdude {

/// Answers lookups of processes of this computer that ask once and then end, so that they need not
/// join the domain: as a lookup of this process, but only what can be read without waiting, in its
/// memory and in that of others, and of a structure that is in force.
/// @par Thread safety  open() and stop() are for one thread.
class OneShots {
 public:
  OneShots(const Context& context, MemoryReads& memory) : context_(context), memory_(memory) {}
  ~OneShots() { stop(); }
  OneShots(const OneShots&) = delete;
  OneShots& operator=(const OneShots&) = delete;

  /// From now on answers, unless no memory is shared, or who asks has to prove its right by keys.
  void open();
  void stop() { socket_.reset(); }

  /// @return empty: who asks must join the domain
  [[nodiscard]] std::optional<OneShotAnswer> answer(const OneShotQuestion& question);

 private:
  /// The owners of the path; empty: not all are reachable.
  [[nodiscard]] std::optional<std::vector<PathSegment>> path_of(
      const std::vector<Segment>& segments);
  /// Whether no joint that had no sample moves any of these edges, as far as is known here.
  [[nodiscard]] bool none_assumed(const std::vector<std::string>& unspecified);
  /// Whether the frame is there, as its owner says.
  [[nodiscard]] bool exists(const std::string& id);
  [[nodiscard]] bool told();

  const Context context_;
  MemoryReads& memory_;
  std::unique_ptr<OneShotSocket> socket_;
};

}  // namespace tfdude
