#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/types/query.hpp"

// Why an answer is as uncertain as it is, or why there is none: Client::why().
namespace tfdude {

/// What stands between a question and its answer.
enum class Obstacle : std::uint8_t {
  kUnknownFrame,     ///< nobody has a frame of that id
  kMissingParent,    ///< the path ends at a frame whose parent does not exist
  kNotConnected,     ///< the frames are in two trees
  kOwnerLost,        ///< the owner of an edge is not reachable, without having said goodbye
  kOwnerStopped,     ///< the owner of an edge was stopped
  kOwnerSilent,      ///< the owner of an edge does not answer
  kNoSample,         ///< a dynamic edge has no sample
  kEndsBefore,       ///< the newest sample of an edge is older than the instant
  kBeginsAfter,      ///< the oldest sample that is kept of an edge is later than the instant
  kNoCommonInstant,  ///< an edge ended before another one began
  kOtherClock,       ///< an owner uses another clock than this participant
  kNobody,           ///< there is no other participant, or none that is understood
  kOther,            ///< see the message
};

/// "unknown_frame", ...
[[nodiscard]] TFDUDE_EXPORT const char* to_string(Obstacle obstacle);

/// Clocks of hosts that differ by more than this are told beside times.
inline constexpr std::chrono::milliseconds kClockDiffers{5};

/// "the clock of partition 'arm' is 3.000 s ahead of the one here".
[[nodiscard]] TFDUDE_EXPORT std::string clock_hint(const std::string& partition,
                                                   std::chrono::nanoseconds ahead);

/// Why there is no answer.
struct Cause {
  Obstacle obstacle = Obstacle::kOther;
  std::string frame;            ///< that is missing, or whose edge is the cause; may be empty
  std::string partition;        ///< its owner; empty: not known
  std::optional<Time> since{};  ///< since when; of the newest sample, or of the loss
  std::string needs;            ///< what would help, as a sentence
  std::vector<std::string> similar{};  ///< ids that are nearly the missing one, the nearest first
  std::optional<std::chrono::nanoseconds> clock_ahead{};  ///< of the owner's host, if that matters
  Error error{};                                          ///< as of the lookup
};

/// A part of a variance, by its origin: a frame's edge, a source of common errors, or a joint.
struct VarianceShare {
  std::string name;
  double variance = 0;  ///< [m²] or [rad²]
  double share = 0;     ///< of the whole, 0 to 1; negative: a correlation that reduces it
};

/// A measurement that is not made yet, and what it would bring.
struct PossibleMeasurement {
  std::string a;  ///< the measurement is of frame b in frame a
  std::string b;
  double variance_after = 0;  ///< of the answer, in the direction of the explanation
};

/// What is known of an owner of edges of the path.
struct OwnerAge {
  std::string partition;
  bool reachable = true;
  std::string slowest{};         ///< its dynamic edge whose newest sample is the oldest
  std::optional<Time> newest{};  ///< of that edge; absent: all of its edges are static
  /// How long ago that was, by this participant's clock; absent: that has no time, or `newest`.
  std::optional<std::chrono::nanoseconds> age{};
  /// How far the clock of its host is ahead of the one here, if they differ: then ages mislead.
  std::optional<std::chrono::nanoseconds> clock_ahead{};
};

/// Why an answer is as it is.
struct Explanation {
  std::optional<StampedTransform> X_AB{};  ///< the answer; absent: see cause
  std::optional<Cause> cause{};

  /// The direction in which B's position is the least certain, a unit vector along the axes of A.
  /// If the position is known exactly, an axis of B, about which the rotation is the least certain.
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
  bool is_rotation = false;
  double variance = 0;  ///< in that direction [m², rad²]; to second order, of specified edges
  /// Parts of that variance, the greatest first. Edges have what is their own; common errors of
  /// several edges are added before they are squared, so they are a share of their source. Edges
  /// and sources together are the whole, except the bound of unknown correlation.
  std::vector<VarianceShare> edges{};
  std::vector<VarianceShare> sources{};
  std::vector<VarianceShare> joints{};  ///< of the edges above, those that a joint moves
  /// The measurement of one edge that would reduce the variance most; absent: none would.
  std::optional<PossibleMeasurement> best{};
  std::vector<std::string> assumed_joints{};  ///< that nobody has measured yet
  std::vector<OwnerAge> owners{};             ///< in the order of the path
};

/// What to explain.
struct WhyQuery {
  std::optional<Time> at{};  ///< as of a lookup
  /// The standard deviations of a possible measurement: three [m], three [rad].
  std::array<double, 6> sensor{1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3};
};

}  // namespace tfdude
