#pragma once

#include <algorithm>
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

  /// A sample that is not newer than all others was told as of this commit, whether it is kept here
  /// or not.
  void corrected(std::uint64_t commit) { corrected_ = std::max(corrected_, commit); }

  /// Adds what was told of a stamp as of a commit of the owner, or replaces it.
  void add(Time stamp, std::uint64_t commit, const Transform& X, const Correlation& correlation);

  /// Whether a sample before the newest one is news as of this commit. What a later commit has told
  /// of it, or may have told, is left as it is.
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

  // An answer has no more.
  static constexpr std::size_t kMost = kMaxItems;

  std::vector<Told> told_;       // by stamp
  std::uint64_t corrected_ = 0;  // the latest commit of corrected()
};

}  // namespace tfdude
