#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "partition/messages.hpp"

namespace tfdude {

/// What a watch was told of an edge's samples, while it may come again: answers and pushes may
/// overtake each other.
class ToldSamples {
 public:
  [[nodiscard]] bool empty() const { return told_.empty(); }
  void clear() { told_.clear(); }

  /// Adds what was told of a stamp as of a commit of the owner, or replaces it.
  void add(Time stamp, std::uint64_t commit, const Transform& X, const Correlation& correlation);

  /// Whether a sample before the newest one is news as of this commit. One of which an earlier
  /// commit tells is none, nor what an answer has from before all that is known here.
  [[nodiscard]] bool is_news(const PushedValue& sample, std::uint64_t commit, bool in_answer);

  /// Forgets what an answer that tells all samples from an instant on does not contain.
  /// @param from  absent: all
  void keep_from(std::optional<Time> from);

 private:
  struct Told {
    Time stamp;
    std::uint64_t commit = 0;
    std::size_t hash = 0;  // of the value
  };
  [[nodiscard]] std::vector<Told>::iterator place_of(Time stamp);

  std::vector<Told> told_;  // by stamp
};

}  // namespace tfdude
