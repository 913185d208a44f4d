#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "partition/watching.hpp"
#include "simulation/timeline.hpp"
#include "tree/forest.hpp"

namespace tfdude::simulation {

/// The owner's side of watched paths, as PushLoop does it, in steps.
class Pushes {
 public:
  using Push = std::function<void(const PushedValues&)>;

  /// @param later  calls push_due() a moment later
  Pushes(Forest& forest, std::function<void()> later, Push push)
      : forest_(forest), later_(std::move(later)), push_(std::move(push)) {}

  /// Starts to push to a group, or continues for another lease.
  [[nodiscard]] Result<PushedValues> watch(std::uint64_t group, const WatchRequest& request,
                                           Instant now);

  /// A reader of the group was matched only now.
  void tell_all(std::uint64_t group);

  /// Pushes the values that were written since the last call, and ends groups that were not
  /// renewed.
  void push_due(Instant now);

  [[nodiscard]] std::vector<std::uint64_t> groups() const {
    std::vector<std::uint64_t> all;
    for (const auto& [group, state] : groups_) all.push_back(group);
    return all;
  }

 private:
  struct Group {
    WatchedGroup watched;
    Instant lease{};
  };

  void push(PushedValues&& pushed);

  Forest& forest_;
  const std::function<void()> later_;
  const Push push_;
  std::map<std::uint64_t, Group> groups_;
};

}  // namespace tfdude::simulation
