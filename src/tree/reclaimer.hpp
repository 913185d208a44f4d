#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "tree/frames.hpp"
#include "tree/sample_history.hpp"
#include "tree/versions.hpp"

namespace tfdude {

/// Gives a forest's writer versions to fill in, and takes what commits have superseded: once no reader can see that any
/// more (epoch.hpp), versions are given out again, and all else is deleted. One writer at a time.
class Reclaimer {
 public:
  template <class T>
  [[nodiscard]] T* take() {
    if constexpr (std::is_same_v<T, HeldVersion>) {
      return held_pool_.take();
    } else {
      return remote_pool_.take();
    }
  }

  // Of the commit that is being made, or of one before. Null is nothing.
  void supersede(Version* version) { versions_.push_back(version); }
  void supersede(SampleHistory* samples) { rings_.superseded.emplace_back(samples); }
  void supersede(EdgeCorrelation* correlation) { ties_.superseded.emplace_back(correlation); }

  /// Whether it is time for collect().
  [[nodiscard]] bool is_due() const { return versions_.size() > kCollectAt; }

  /// To be called between two commits.
  void collect(Frames& frames);

 private:
  // How many superseded versions may wait before the readers are asked: rare enough to cost little (locked
  // instructions, and the readers' cache lines), few enough that the pool stays in the first-level cache.
  static constexpr std::size_t kCollectAt = 64;

  template <class T>
  struct Waiting {
    std::vector<std::unique_ptr<T>> superseded;  // since the readers were last asked
    std::vector<std::unique_ptr<T>> retired;     // with a tag

    void collect(std::uint64_t tag, std::uint64_t safe_below);
  };

  VersionPool<HeldVersion> held_pool_;
  VersionPool<Version> remote_pool_;
  std::vector<Version*> versions_;  // superseded since the readers were last asked
  Waiting<SampleHistory> rings_;
  Waiting<EdgeCorrelation> ties_;
};

}  // namespace tfdude
