#pragma once

#include <cstdint>

#include "tree/versions.hpp"

// What a walk needs of an edge that is held here. RemoteEdge has the same of an edge that another
// process holds.
namespace tfdude {

/// The samples of an edge.
class OwnSamples {
 public:
  explicit OwnSamples(const HeldVersion& edge) : samples_(*edge.samples) {}

  [[nodiscard]] bool has_noise() const { return samples_.has_noise(); }
  [[nodiscard]] const Covariance& process_noise() const { return samples_.timing().process_noise; }
  [[nodiscard]] bool drifts() const { return samples_.timing().drifts; }
  [[nodiscard]] std::uint64_t oldest() const { return samples_.oldest(); }
  [[nodiscard]] const Sample* sample(std::uint64_t number) const { return samples_.sample(number); }
  [[nodiscard]] SampleHistory::Bracket around(std::int64_t t, std::uint64_t newest,
                                              std::uint64_t& back) const {
    return samples_.around(t, newest, back);
  }
  [[nodiscard]] std::int64_t reach(std::uint64_t newest) const { return samples_.reach(newest); }
  [[nodiscard]] bool is_timed_since(std::int64_t t, std::uint64_t newest) const {
    return samples_.is_timed_since(t, newest);
  }

  /// Whether the sample is a pose as it was given; then its parts stay in place.
  [[nodiscard]] static bool given_parts(const Sample& sample, TransformParts& parts) {
    if (!sample.is_given_pose()) return false;
    parts = sample.parts();
    return true;
  }
  struct Copies {};
  /// Makes samples refer to what can be read here. `after` may be null. @return whether that is all
  [[nodiscard]] static bool make_whole(SampleHistory::Bracket&, Copies&) { return true; }

 private:
  const SampleHistory& samples_;
};

/// An edge that is held here.
struct OwnEdge {
  const HeldVersion* version = nullptr;

  [[nodiscard]] OwnSamples samples() const { return OwnSamples(*version); }

  struct Copy {};
  /// What is said of its correlation, and what that is now; null: nothing.
  /// @param copy  keeps it, if it cannot be read where it is @return whether it could be read
  [[nodiscard]] bool find_said(Copy& /*copy*/, const Correlation*& found) const {
    found = version->correlation != nullptr ? &version->correlation->said() : nullptr;
    return true;
  }
  [[nodiscard]] bool find_now(Copy& /*copy*/, const Correlation*& found) const {
    found = version->correlation != nullptr ? &version->correlation->now() : nullptr;
    return true;
  }
};

}  // namespace tfdude
