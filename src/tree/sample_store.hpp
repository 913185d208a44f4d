#pragma once

#include <cstddef>
#include <cstdint>

#include "tree/pool.hpp"
#include "tree/sample.hpp"

namespace tfdude {

/// The memory of the samples of all histories. One writer at a time.
class SampleStore {
 public:
  explicit SampleStore(Arena& arena)
      : arena_(arena), chunks_(arena), covariances_(arena), joints_(arena) {}

  [[nodiscard]] Arena& arena() { return arena_; }

  [[nodiscard]] SampleChunk* take_chunk() {
    bytes_ += sizeof(SampleChunk);
    return chunks_.take();
  }
  void supersede(SampleChunk* chunk) {
    bytes_ -= sizeof(SampleChunk);
    chunks_.supersede(chunk);
  }

  /// What a new sample shares with one of its neighbours, if they have it in common; otherwise a
  /// new part.
  /// @param neighbour  null: there is none
  [[nodiscard]] const SharedPart* share(const GivenValue& value, const SharedPart* neighbour,
                                        const SharedPart* other = nullptr);

  /// For a sample that is dropped. What it shares goes with the last sample that does.
  void release(const SharedPart* shared) {
    if (--of_writer(shared).samples == 0) supersede(shared);
  }

  /// For a sample that is dropped, and remembered: it shares as before.
  void keep(const SharedPart* shared) { ++of_writer(shared).samples; }
  /// Memory of what is remembered of samples and edges.
  void add(std::size_t bytes) { bytes_ += bytes; }
  void subtract(std::size_t bytes) { bytes_ -= bytes; }

  /// Of all samples.
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

  void collect(std::uint64_t tag, std::uint64_t safe_below) {
    chunks_.collect(tag, safe_below);
    covariances_.collect(tag, safe_below);
    joints_.collect(tag, safe_below);
  }

 private:
  // Only readers see it as constant.
  [[nodiscard]] static SharedPart& of_writer(const SharedPart* shared) {
    return const_cast<SharedPart&>(*shared);  // NOLINT(*-const-cast): see above
  }
  [[nodiscard]] const SharedPart* fresh_part(const GivenValue& value);
  void supersede(const SharedPart* shared);

  Arena& arena_;
  Pool<SampleChunk> chunks_;
  Pool<SharedCovariance> covariances_;
  Pool<SharedJoint> joints_;
  std::size_t bytes_ = 0;
};

/// The memory of a part that samples share.
[[nodiscard]] inline std::size_t bytes_of(const SharedPart& shared) {
  if (shared.is_joint) return sizeof(SharedJoint);
  const SharedRevision* revision = static_cast<const SharedCovariance&>(shared).revision;
  return sizeof(SharedCovariance) + (revision != nullptr ? revision->bytes() : 0);
}

}  // namespace tfdude
