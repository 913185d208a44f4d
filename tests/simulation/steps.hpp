#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "simulation/timeline.hpp"

namespace tfdude::simulation {

/// The steps of a run, each with a hash of it and of all before it: two runs of one seed must have
/// the same.
class Steps {
 public:
  Steps() { steps_.reserve(1U << 15U); }

  struct Step {
    std::uint64_t hash = 0;
    Instant when{};
    Touch touch;
  };

  void add(Instant when, const Touch& touch);
  /// Adds to the last step what it carries, or what has changed.
  void mix(std::uint64_t value);
  void mix(std::string_view text);

  [[nodiscard]] std::size_t size() const { return steps_.size(); }

 private:
  friend std::optional<std::string> first_difference(const Steps& one, const Steps& other);

  std::vector<Step> steps_;
};

/// The first step at which two runs differ; empty: they do not.
[[nodiscard]] std::optional<std::string> first_difference(const Steps& one, const Steps& other);

}  // namespace tfdude::simulation
