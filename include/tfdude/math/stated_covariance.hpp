#pragma once

#include <cstdint>

#include "tfdude/math/covariance.hpp"

namespace tfdude {

/// A covariance, as far as it was specified. A transform may consist of edges of which some have
/// none, such as those of a source that knows of no uncertainty. Their errors are not zero, but not
/// known.
///
/// @par Reading  The numbers of a covariance that is not complete are too small, and nothing in
///   them shows it. So there is no access that leaves the question open: if_complete() has a result
///   only if nothing is missing, and of_specified() says in its name what it leaves out. This is a
///   type of its own, and not a flag beside a Covariance, because a flag can be overlooked.
/// @par Writing  A Covariance converts to it, and is complete. What nobody gives is unspecified:
///   zero means known exactly, and has to be said (exact()).
class StatedCovariance {
 public:
  /// Nothing is known.
  StatedCovariance() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): it is one, of the same meaning
  StatedCovariance(const Covariance& complete) : of_specified_(complete), incomplete_(0) {}

  /// Nothing is known, as by default.
  [[nodiscard]] static StatedCovariance unspecified() { return {}; }
  /// Zero: known exactly.
  [[nodiscard]] static StatedCovariance exact() { return Covariance(); }
  /// That of the edges which have one; others have none.
  [[nodiscard]] static StatedCovariance incomplete(const Covariance& of_specified) {
    StatedCovariance sigma = of_specified;
    sigma.incomplete_ = 1;
    return sigma;
  }

  /// As Covariance::trusted().
  [[nodiscard]] static StatedCovariance trusted(const Covariance::Upper& upper, bool complete) {
    return {upper, complete};
  }

  /// Whether no edge is unspecified.
  [[nodiscard]] bool complete() const { return incomplete_ == 0; }
  /// The covariance; null if an edge is unspecified.
  [[nodiscard]] const Covariance* if_complete() const {
    return complete() ? &of_specified_ : nullptr;
  }
  /// The covariance of those edges that have one. The others count as if they were known exactly.
  [[nodiscard]] const Covariance& of_specified() const { return of_specified_; }

  /// As Covariance::transported().
  [[nodiscard]] StatedCovariance transported(const Pose& X) const {
    StatedCovariance sigma = of_specified_.transported(X);
    sigma.incomplete_ = incomplete_;
    return sigma;
  }

  /// Of independent errors.
  StatedCovariance& operator+=(const StatedCovariance& other) {
    of_specified_ += other.of_specified_;
    incomplete_ |= other.incomplete_;
    return *this;
  }

  /// For code that has computed the numbers in place.
  void set_complete(bool complete) { incomplete_ = complete ? 0 : 1; }

  friend bool operator==(const StatedCovariance& a, const StatedCovariance& b) {
    return a.incomplete_ == b.incomplete_ && a.of_specified_.upper() == b.of_specified_.upper();
  }
  friend bool operator!=(const StatedCovariance& a, const StatedCovariance& b) { return !(a == b); }

 private:
  StatedCovariance(const Covariance::Upper& upper, bool complete)
      : of_specified_(Covariance::trusted(upper)), incomplete_(complete ? 0 : 1) {}

  Covariance of_specified_;
  // 1 or 0; as wide as a number, so that a copy need not wait for a narrower store.
  std::uint64_t incomplete_ = 1;
};

[[nodiscard]] inline StatedCovariance operator+(StatedCovariance a, const StatedCovariance& b) {
  return a += b;
}

}  // namespace tfdude
