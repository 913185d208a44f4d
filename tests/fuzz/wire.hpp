#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "fuzz/demand.hpp"
#include "support/samples.hpp"
#include "transport/fastdds/field_values.hpp"

// Shared by all harnesses of DDS samples: reads the bytes as a reader does, up to the message.
namespace tfdude::fuzz {

using testing::Bytes;

/// The sample that a reader deserializes from the bytes; none if it rejects them. Checks that the
/// reader rejects exactly the bytes that are not well-formed, and that its result does not depend
/// on earlier samples.
template <class Type, class Sample>
[[nodiscard]] std::optional<Sample> received(const Bytes& bytes, bool well_formed) {
  static Sample reused;
  Sample fresh;
  const bool taken = testing::deserialized<Type>(bytes, fresh);
  demand(taken == well_formed, "what is well formed is taken, and nothing else");
  const bool taken_again = testing::deserialized<Type>(bytes, reused);
  demand(taken_again == taken, "a used sample takes what a fresh one does");
  if (!taken) return std::nullopt;
  demand(testing::serialized<Type>(reused) == testing::serialized<Type>(fresh),
         "nothing is left of what a sample held before");
  return fresh;
}

/// A sample after it was sent and received.
template <class Type, class Sample>
[[nodiscard]] Sample travelled(const Sample& sample) {
  Sample arrived;
  const Bytes bytes = testing::serialized<Type>(sample);
  demand(!bytes.empty(), "what was read can be sent");
  demand(testing::deserialized<Type>(bytes, arrived), "what was sent can be received");
  return arrived;
}

template <class T>
void demand_refusal(const Result<T>& result) {
  demand(result.error().code == Errc::kInvalidInput || result.error().code == Errc::kUnsupported,
         "what is refused is called invalid or unsupported");
  demand_printable(result.error());
}

/// The largest difference of two transforms that count as equal.
struct Tolerance {
  double rotation;    // of each number of the quaternion
  double covariance;  // of each number of the matrix scaled to a unit diagonal
};

/// Quaternions are normalized, and eigenvalues lifted to zero, on arrival...
inline constexpr Tolerance kOnArrival{2e-3, 1e-8};
/// ...and hardly again when they travel on.
inline constexpr Tolerance kAgain{1e-15, 1e-12};

inline constexpr std::size_t kSigma = 7;  // where the covariance begins

/// Whether a covariance is so small in places that eigenvalues lifted by 1e-9 of it underflow to
/// zero again.
[[nodiscard]] inline bool underflows(const fastdds::Numbers& x_pc) {
  return std::any_of(x_pc.begin() + kSigma, x_pc.end(),
                     [](double value) { return value != 0 && std::abs(value) < 1e-200; });
}

/// The standard deviations by which the library judges a covariance: an axis that is far more
/// certain than the others of its unit is judged by those.
[[nodiscard]] inline std::array<double, 6> judged_stddev(const fastdds::Numbers& x_pc) {
  std::array<double, 6> judged{};
  for (std::size_t i = 0; i < 6; ++i) {
    const std::size_t unit = i / 3 * 3;
    double largest = 0;
    for (std::size_t j = unit; j < unit + 3; ++j) {
      largest = std::max(largest, x_pc[kSigma + upper_index(j, j)]);
    }
    judged[i] = std::sqrt(std::max(x_pc[kSigma + upper_index(i, i)], 1e-3 * largest));
  }
  return judged;
}

inline void demand_same(const fastdds::Numbers& a, const fastdds::Numbers& b, Tolerance tolerance) {
  demand(a.size() == b.size(), "a transform keeps its numbers");
  const auto near = [](double x, double y, double bound) {
    return x == y || std::abs(x - y) <= bound;
  };
  for (std::size_t i = 0; i < 4; ++i) {
    demand(near(a[i], b[i], tolerance.rotation), "a rotation stays what it is");
  }
  demand(std::equal(a.begin() + 4, a.begin() + 7, b.begin() + 4), "a translation stays what it is");
  if (a.size() == kSigma || underflows(a)) return;  // unspecified
  const auto judged = judged_stddev(a);
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = i; j < 6; ++j) {
      const std::size_t k = kSigma + upper_index(i, j);
      demand(near(a[k], b[k], tolerance.covariance * judged[i] * judged[j]),
             "a covariance stays what it is");
    }
  }
}

/// A sample without its transforms, which are compared with a tolerance; strip() takes them out,
/// and sets to zero what a message does not keep.
template <class Type, class Sample, class Strip>
void demand_same(Sample a, Sample b, Strip strip, Tolerance tolerance) {
  std::vector<fastdds::Numbers> of_a;
  std::vector<fastdds::Numbers> of_b;
  strip(a, of_a);
  strip(b, of_b);
  demand(testing::serialized<Type>(a) == testing::serialized<Type>(b),
         "what was read is what had come");
  demand(of_a.size() == of_b.size(), "as many transforms");
  for (std::size_t i = 0; i < of_a.size(); ++i) demand_same(of_a[i], of_b[i], tolerance);
}

inline void take_out(fastdds::Numbers& x_pc, std::vector<fastdds::Numbers>& out) {
  out.push_back(x_pc);
  x_pc.clear();
}

/// Reads a sample into a message, sends that, and reads it again: all three must be equal.
/// @param encode  message to sample
/// @param decode  sample to Result of a message
template <class Type, class Sample, class Encode, class Decode, class Strip>
[[nodiscard]] auto round_trip(const Sample& sample, Encode encode, Decode decode, Strip strip) {
  auto message = decode(sample);
  if (!message) {
    demand_refusal(message);
    return message;
  }
  const Sample sent = encode(*message);
  demand_same<Type>(sample, sent, strip, kOnArrival);
  const auto again = decode(travelled<Type>(sent));
  demand(again.has_value(), "a message that was taken is taken again");
  demand_same<Type>(sent, Sample(encode(*again)), strip, kAgain);
  return message;
}

}  // namespace tfdude::fuzz
