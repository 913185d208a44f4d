#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "transport/fastdds/compat.hpp"
#include "transport/fastdds/field_kinds.hpp"

// Kinds of fields that several messages have: transforms, as sequences of numbers, and
// correlations.
namespace tfdude::fastdds {

using Numbers = std::vector<double>;

inline constexpr std::size_t kPoseNumbers = 7;
inline constexpr std::uint32_t kTransformNumbers = kPoseNumbers + Covariance::kSize;

/// Whether the covariance is absent.
[[nodiscard]] inline bool is_pose_only(const Numbers& in) { return in.size() == kPoseNumbers; }

/// The first seven numbers, without the covariance.
void write_pose(const Pose& pose, Numbers& out);

/// The covariance of which these are the numbers from `first` on.
[[nodiscard]] Result<Covariance> read_covariance(const Numbers& in, std::size_t first);

/// A transform that a user has given: 28 numbers, or seven if its covariance is not complete. An
/// error names the frame and what is wrong.
struct GivenTransform {
  static void check(CdrReader& in) { in.numbers(kTransformNumbers); }
  static void write(const Transform& X, Numbers& wire);
  static Result<void> read(const Numbers& wire, Transform& X, const Place& place);
};

/// A transform that was computed (computed_from()): all 28 numbers. That its covariance is not
/// complete is said elsewhere.
struct ComputedTransform {
  static void check(CdrReader& in) { in.numbers(kTransformNumbers); }
  static void write(const Transform& X, Numbers& wire);
  static Result<void> read(const Numbers& wire, Transform& X, const Place& place);
};

/// An edge by its child frame, with such a transform.
struct GivenEdge {
  static void check(CdrReader& in);
  static void write(const EdgeUpdate& edge, wire::Edge& wire);
  static Result<void> read(const wire::Edge& wire, EdgeUpdate& edge, const Place& place);
};

/// Parts of a transform, in two fields: which ones are given, as bits, and the numbers, of which
/// the others are ignored.
struct PartialNumbers {
  static void check(CdrReader& in) {
    Octet::check(in);
    in.numbers(kTransformNumbers);
  }
  template <class Wire>
  static void write(const PartialTransform& parts, Wire& wire) {
    wire.parts() = write_parts(parts, wire.x_pc());
  }
  template <class Wire>
  static Result<void> read(const Wire& wire, PartialTransform& parts, const Place& place) {
    return read_parts(wire.parts(), wire.x_pc(), parts, place);
  }

 private:
  static std::uint8_t write_parts(const PartialTransform& parts, Numbers& out);
  static Result<void> read_parts(std::uint8_t given, const Numbers& in, PartialTransform& parts,
                                 const Place& place);
};

/// How an edge, or a segment, is correlated with others. An error names the place, and the source
/// or the part of unknown correlation.
struct AnyCorrelation {
  static void check(CdrReader& in);
  static void write(const Correlation& correlation, wire::Correlation& wire);
  static void write(const PathCorrelation& correlation, wire::Correlation& wire);
  static Result<void> read(const wire::Correlation& wire, Correlation& correlation,
                           const Place& place);
  static Result<void> read(const wire::Correlation& wire, PathCorrelation& correlation,
                           const Place& place);
};

/// Samples with one stamp (codec_streams.cpp).
struct JointSamples {
  static void check(CdrReader& in);
  static void write(const JointUpdate& update, wire::Joints& wire);
  static Result<void> read(const wire::Joints& wire, JointUpdate& update, const Place&);
};

/// What is known of frames that are handed over (codec_handover.cpp).
struct Handed {
  static void check(CdrReader& in);
  static void write(const HandedPart& part, wire::HandedPart& wire);
  static Result<void> read(const wire::HandedPart& wire, HandedPart& part, const Place& place);
};

/// What a watcher is sent (codec_streams.cpp).
struct Pushed {
  static void check(CdrReader& in);
  static void write(const PushedValues& pushed, wire::State& wire);
  static Result<void> read(const wire::State& wire, PushedValues& pushed, const Place&);
};

}  // namespace tfdude::fastdds
