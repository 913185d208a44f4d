#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

#include "partition/partition.hpp"
#include "support/forest_support.hpp"
#include "support/random.hpp"
#include "support/replica.hpp"

// Owners that fight over the same few frames.
namespace tfdude::testing {

/// An owner, with the messages that it has sent.
struct Owning {
  Owning(const std::string& name, std::uint64_t incarnation)
      : replica(name), partition(name, incarnation, replica.forest, replica.directory) {}

  Replica replica;
  Partition partition;
  std::map<std::uint32_t, Page> published;
  Presence presence;
};

[[nodiscard]] inline std::string fought_frame(std::size_t number) {
  return "f" + std::to_string(number);
}

/// A request to add one of so many frames, or to move or remove it if this owner holds it, as far
/// as this owner knows.
[[nodiscard]] inline Request any_change(Random& random, const Forest& forest, std::size_t frames) {
  const std::string id = fought_frame(random.index(frames));
  const std::string other = fought_frame(random.index(frames));
  const std::string parent = forest.exists(other) ? other : "";
  Request request{0, id, AddRequest{parent, along_x(1)}};
  if (forest.holds(id)) {
    request.body = MoveRequest{parent, {}};
    if (random.index(3) == 0) request.body = RemoveRequest{{id}};
  }
  return request;
}

}  // namespace tfdude::testing
