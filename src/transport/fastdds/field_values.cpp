#include "transport/fastdds/field_values.hpp"

#include <algorithm>
#include <string>
#include <tuple>

#include "tfdude/base/id.hpp"

#include "math/flat.hpp"
#include "transport/fastdds/fields.hpp"

namespace tfdude::fastdds {

// ---- transforms

namespace {

Result<void> check_size(const Numbers& in) {
  if (in.size() == kTransformNumbers || is_pose_only(in)) return {};
  return fail(Errc::kInvalidInput, "a transform of " + std::to_string(in.size()) + " numbers");
}

Result<Transform> read_given(const Numbers& in) {
  if (auto ok = check_size(in); !ok) return tl::unexpected(std::move(ok.error()));
  const auto pose =
      Pose::create(Eigen::Quaterniond(in[3], in[0], in[1], in[2]), {in[4], in[5], in[6]});
  if (!pose) return tl::unexpected(pose.error());
  if (is_pose_only(in)) return Transform{*pose, StatedCovariance::unspecified()};
  const auto covariance = read_covariance(in, kPoseNumbers);
  if (!covariance) return tl::unexpected(covariance.error());
  return Transform{*pose, *covariance};
}

Result<Transform> read_computed(const Numbers& in) {
  if (auto ok = check_size(in); !ok) return tl::unexpected(std::move(ok.error()));
  if (!is_pose_only(in)) {
    Flat flat{};
    std::copy(in.begin(), in.end(), flat.begin());
    return computed_from(flat);
  }
  return computed_pose(Eigen::Quaterniond(in[3], in[0], in[1], in[2]), {in[4], in[5], in[6]})
      .map([](const Pose& X) {
        return Transform{X, StatedCovariance::unspecified()};
      });
}

// An error names the place only where something is wrong: most transforms are right.
Result<void> put(const Result<Transform>& read, Transform& X, const Place& place) {
  if (!read) return place.fail(read.error());
  X = *read;
  return {};
}

}  // namespace

void write_pose(const Pose& pose, Numbers& out) {
  const Flat flat = to_flat({pose, Covariance()});
  out.assign(flat.begin(), flat.begin() + kPoseNumbers);
}

Result<Covariance> read_covariance(const Numbers& in, std::size_t first) {
  Covariance::Upper upper{};
  const std::size_t count = in.size() - std::min(first, in.size());
  if (count != upper.size()) {
    return fail(Errc::kInvalidInput, "a covariance of " + std::to_string(count) + " numbers");
  }
  std::copy_n(in.end() - Covariance::kSize, Covariance::kSize, upper.begin());
  return Covariance::from_upper(upper);
}

void GivenTransform::write(const Transform& X, Numbers& wire) {
  if (!X.covariance.complete()) return write_pose(X.pose, wire);
  ComputedTransform::write(X, wire);
}

Result<void> GivenTransform::read(const Numbers& wire, Transform& X, const Place& place) {
  return put(read_given(wire), X, place);
}

void ComputedTransform::write(const Transform& X, Numbers& wire) {
  const Flat flat = to_flat(X);
  wire.assign(flat.begin(), flat.end());
}

Result<void> ComputedTransform::read(const Numbers& wire, Transform& X, const Place& place) {
  return put(read_computed(wire), X, place);
}

namespace {

constexpr auto kEdge =
    record(TFDUDE_FIELD(id, id, FrameId()), TFDUDE_FIELD(x_pc, X_PC, GivenTransform()));

}  // namespace

void GivenEdge::check(CdrReader& in) { kEdge.check(in); }

void GivenEdge::write(const EdgeUpdate& edge, wire::Edge& wire) { kEdge.write(edge, wire); }

Result<void> GivenEdge::read(const wire::Edge& wire, EdgeUpdate& edge, const Place& place) {
  return kEdge.read(wire, edge, place);
}

// ---- parts of transforms

namespace {

// Bits of wire::PartialEdge::parts.
enum Part : std::uint8_t { kTranslation = 1, kRotation = 2, kCovariance = 4 };

}  // namespace

std::uint8_t PartialNumbers::write_parts(const PartialTransform& parts, Numbers& out) {
  const Pose pose = Pose::trusted(parts.rotation.value_or(Eigen::Quaterniond::Identity()),
                                  parts.translation.value_or(Eigen::Vector3d::Zero()));
  GivenTransform::write({pose, parts.covariance.value_or(StatedCovariance::unspecified())}, out);
  return static_cast<std::uint8_t>((parts.translation ? kTranslation : 0) |
                                   (parts.rotation ? kRotation : 0) |
                                   (parts.covariance ? kCovariance : 0));
}

Result<void> PartialNumbers::read_parts(std::uint8_t given, const Numbers& in,
                                        PartialTransform& parts, const Place& place) {
  if (in.size() < kPoseNumbers) return place.fail(check_size(in).error());
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  if ((given & kRotation) != 0) rotation = Eigen::Quaterniond(in[3], in[0], in[1], in[2]);
  if ((given & kTranslation) != 0) translation = {in[4], in[5], in[6]};
  const auto pose = Pose::create(rotation, translation);
  if (!pose) return place.fail(pose.error());
  if ((given & kRotation) != 0) parts.rotation = pose->rotation();
  if ((given & kTranslation) != 0) parts.translation = pose->translation();
  if ((given & kCovariance) == 0) return {};
  parts.covariance = StatedCovariance::unspecified();
  if (is_pose_only(in)) return {};
  const auto covariance = read_covariance(in, kPoseNumbers);
  if (!covariance) return place.fail(covariance.error());
  parts.covariance = *covariance;
  return {};
}

// ---- correlations

namespace {

// A 6xk matrix, column by column.
struct LoadingNumbers {
  static void check(CdrReader& in) {
    in.numbers(6 * static_cast<std::uint32_t>(kMaxLoadingColumns));
  }
  static void write(const Loading& loading, Numbers& wire) {
    wire.assign(loading.data(), loading.data() + loading.size());
  }
  static Result<void> read(const Numbers& wire, Loading& loading, const Place& place) {
    if (wire.size() % 6 != 0) {
      return place.fail(
          {Errc::kInvalidInput, "a loading of " + std::to_string(wire.size()) + " numbers"});
    }
    loading = Eigen::Map<const Loading>(wire.data(), 6, static_cast<Eigen::Index>(wire.size() / 6));
    return {};
  }
};

// Whether an edge's own covariance is of unknown correlation. A segment has that part by itself.
struct OwnIsUnknown : Octet {
  static void write(const Correlation& of, std::uint8_t& wire) { wire = of.unknown ? 1 : 0; }
  static void write(const PathCorrelation&, std::uint8_t& wire) { wire = 0; }
  static Result<void> read(std::uint8_t wire, Correlation& of, const Place&) {
    of.unknown = wire != 0;
    return {};
  }
  static Result<void> read(std::uint8_t, PathCorrelation&, const Place&) { return {}; }
};

struct UnknownPart {
  static void check(CdrReader& in) { in.numbers(Covariance::kSize); }
  static void write(const Correlation&, Numbers& wire) { wire.clear(); }
  static void write(const PathCorrelation& of, Numbers& wire) {
    wire.clear();
    if (of.unknown) wire.assign(of.unknown->upper().begin(), of.unknown->upper().end());
  }
  static Result<void> read(const Numbers& wire, Correlation&, const Place& place) {
    PathCorrelation unused;
    return read(wire, unused, place);
  }
  static Result<void> read(const Numbers& wire, PathCorrelation& of, const Place& place) {
    if (wire.empty()) return {};
    if (wire.size() != Covariance::kSize) {
      return place.fail(
          {Errc::kInvalidInput, "a covariance of " + std::to_string(wire.size()) + " numbers"});
    }
    Covariance::Upper upper{};
    std::copy(wire.begin(), wire.end(), upper.begin());
    of.unknown = Covariance::trusted(upper);
    if (auto ok = check_finite({Pose(), *of.unknown}); !ok) return place.fail(ok.error());
    return {};
  }
};

constexpr auto kCommonError =
    record(TFDUDE_FIELD(subtracts, subtracts, Octet()),
           TFDUDE_FIELD(loading, loading, LoadingNumbers()), TFDUDE_FIELD(source, source, Text()));

constexpr auto kCorrelation = record(
    TFDUDE_FIELD_OF_ALL(unknown, OwnIsUnknown()), TFDUDE_FIELD_OF_ALL(unknown_part, UnknownPart()),
    TFDUDE_FIELD(common_errors, common_errors, List(kCommonError, kMaxCorrelated)),
    TFDUDE_FIELD(observed_with, observed_with, List(Text(), kMaxCorrelated)));

template <class Any>
Result<void> read_correlation(const wire::Correlation& wire, Any& correlation, const Place& place) {
  if (auto ok = kCorrelation.read(wire, correlation, place); !ok) return ok;
  if (auto ok = check_common_errors(correlation.common_errors); !ok) return place.fail(ok.error());
  return {};
}

}  // namespace

void AnyCorrelation::check(CdrReader& in) { kCorrelation.check(in); }

void AnyCorrelation::write(const Correlation& correlation, wire::Correlation& wire) {
  kCorrelation.write(correlation, wire);
}

void AnyCorrelation::write(const PathCorrelation& correlation, wire::Correlation& wire) {
  kCorrelation.write(correlation, wire);
}

Result<void> AnyCorrelation::read(const wire::Correlation& wire, Correlation& correlation,
                                  const Place& place) {
  return read_correlation(wire, correlation, place);
}

Result<void> AnyCorrelation::read(const wire::Correlation& wire, PathCorrelation& correlation,
                                  const Place& place) {
  return read_correlation(wire, correlation, place);
}

}  // namespace tfdude::fastdds
