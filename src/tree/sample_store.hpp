#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "tree/pool.hpp"
#include "tree/sample.hpp"

namespace tfdude {

/// The memory of the samples of all histories. One writer at a time.
class SampleStore {
 public:
  [[nodiscard]] SampleChunk* take_chunk() {
    bytes_ += sizeof(SampleChunk);
    return chunks_.take();
  }
  void supersede(SampleChunk* chunk) {
    bytes_ -= sizeof(SampleChunk);
    chunks_.supersede(chunk);
  }

  /// The covariance for a new sample: that of its neighbour, if it is the same; null: there is no
  /// neighbour.
  [[nodiscard]] const SharedCovariance* share(const StatedCovariance& covariance,
                                              const Sample* neighbour) {
    if (neighbour != nullptr && same(covariance, neighbour->covariance->value)) {
      ++of_writer(neighbour->covariance).samples;
      return neighbour->covariance;
    }
    SharedCovariance* fresh = covariances_.take();
    bytes_ += sizeof(SharedCovariance);
    fresh->value = covariance;
    fresh->samples = 1;
    return fresh;
  }

  /// For a sample that is dropped. Its covariance goes with the last sample that has it.
  void release(const Sample& sample) {
    SharedCovariance& covariance = of_writer(sample.covariance);
    if (--covariance.samples > 0) return;
    bytes_ -= sizeof(SharedCovariance);
    covariances_.supersede(&covariance);
  }

  /// Of all samples.
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

  void collect(std::uint64_t tag, std::uint64_t safe_below) {
    chunks_.collect(tag, safe_below);
    covariances_.collect(tag, safe_below);
  }

 private:
  // Bit by bit, so zeros of two signs count as different. Takes a third of the time of memcmp().
  [[nodiscard]] static bool same(const StatedCovariance& a, const StatedCovariance& b) {
    static_assert(std::is_trivially_copyable_v<StatedCovariance>);
    using Pair = std::uint64_t __attribute__((vector_size(16)));
    constexpr std::size_t kPairs = sizeof(StatedCovariance) / sizeof(Pair);
    static_assert(sizeof(StatedCovariance) == kPairs * sizeof(Pair));
    const auto pair = [](const StatedCovariance& of, std::size_t i) {
      Pair copy;
      // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): only its bytes
      std::memcpy(&copy, reinterpret_cast<const char*>(&of) + i * sizeof(Pair), sizeof(Pair));
      return copy;
    };
    Pair different = pair(a, 0) ^ pair(b, 0);
    for (std::size_t i = 1; i < kPairs; ++i) different |= pair(a, i) ^ pair(b, i);
    return (different[0] | different[1]) == 0;
  }

  // Only readers see it as constant.
  [[nodiscard]] static SharedCovariance& of_writer(const SharedCovariance* covariance) {
    return const_cast<SharedCovariance&>(*covariance);
  }

  Pool<SampleChunk> chunks_;
  Pool<SharedCovariance> covariances_;
  std::size_t bytes_ = 0;
};

}  // namespace tfdude
