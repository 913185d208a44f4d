#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "tree/frames.hpp"
#include "tree/pool.hpp"
#include "tree/sample_history.hpp"
#include "tree/sample_store.hpp"
#include "tree/versions.hpp"

namespace tfdude {

/// Provides a forest's writer with versions to fill in, and takes superseded objects. Once no
/// reader can see them (epoch.hpp), versions are reused, and all others are deleted. One writer at
/// a time.
class Reclaimer {
 public:
  explicit Reclaimer(Arena& arena) : held_pool_(arena), remote_pool_(arena), samples_(arena) {}

  template <class T>
  [[nodiscard]] T* take() {
    if constexpr (std::is_same_v<T, HeldVersion>) {
      return held_pool_.take();
    } else {
      return remote_pool_.take();
    }
  }

  /// See Pool::prefetch().
  void prefetch_held(std::size_t ahead) const { held_pool_.prefetch(ahead); }

  // Takes an object superseded by the current commit, or by an earlier one. Ignores null.
  void supersede(Version* version) {
    ++superseded_;
    if (version->held()) {
      held_pool_.supersede(static_cast<HeldVersion*>(version));
    } else {
      remote_pool_.supersede(version);
    }
  }
  void supersede(SampleHistory* samples) { histories_.superseded.emplace_back(samples); }
  void supersede(EdgeCorrelation* correlation) {
    correlations_.superseded.emplace_back(correlation);
  }

  /// See Pool::superseded().
  [[nodiscard]] const std::vector<HeldVersion*>& superseded_held() const {
    return held_pool_.superseded();
  }

  [[nodiscard]] SampleStore& samples() { return samples_; }

  /// Whether collect() is due.
  [[nodiscard]] bool is_due() const { return superseded_ > kCollectAt; }

  /// Call only between two commits.
  void collect(Frames& frames);

 private:
  // How many superseded versions may wait before the readers are checked. Rare enough to cost
  // little (locked instructions, and the readers' cache lines), few enough that the pool stays in
  // the first-level cache.
  static constexpr std::size_t kCollectAt = 64;

  template <class T, class Pointer>
  struct Waiting {
    std::vector<Pointer> superseded;  // since the readers were last checked
    std::vector<Pointer> retired;     // with a tag

    void collect(std::uint64_t tag, std::uint64_t safe_below);
  };

  Pool<HeldVersion> held_pool_;
  Pool<Version> remote_pool_;
  SampleStore samples_;
  std::size_t superseded_ = 0;  // versions, since the readers were last checked
  Waiting<SampleHistory, SampleHistory::Pointer> histories_;
  Waiting<EdgeCorrelation, InArena<EdgeCorrelation>> correlations_;
};

}  // namespace tfdude
