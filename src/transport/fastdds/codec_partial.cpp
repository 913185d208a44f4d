#include "transport/fastdds/codec_partial.hpp"

#include <utility>

#include "tfdude/base/id.hpp"

#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/codec_correlation.hpp"

namespace tfdude::fastdds {
namespace {

// Bits of wire::PartialEdge::parts.
enum Part : std::uint8_t { kTranslation = 1, kRotation = 2, kCovariance = 4 };

}  // namespace

std::uint8_t write_parts(const PartialTransform& parts, Numbers& out) {
  const Pose pose = Pose::trusted(parts.rotation.value_or(Eigen::Quaterniond::Identity()),
                                  parts.translation.value_or(Eigen::Vector3d::Zero()));
  if (parts.covariance) {
    write_transform({pose, *parts.covariance}, out);
  } else {
    write_pose(pose, out);
  }
  return static_cast<std::uint8_t>((parts.translation ? kTranslation : 0) |
                                   (parts.rotation ? kRotation : 0) |
                                   (parts.covariance ? kCovariance : 0));
}

Result<PartialTransform> read_parts(std::uint8_t given, const Numbers& in, std::string_view frame) {
  const auto at_frame = [&](const Error& error) { return fail_at("frame " + quote(frame), error); };
  if (in.size() < kPoseNumbers) {
    return at_frame(
        {Errc::kInvalidInput, "a transform of " + std::to_string(in.size()) + " numbers"});
  }
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  if ((given & kRotation) != 0) rotation = Eigen::Quaterniond(in[3], in[0], in[1], in[2]);
  if ((given & kTranslation) != 0) translation = {in[4], in[5], in[6]};
  const auto pose = Pose::create(rotation, translation);
  if (!pose) return at_frame(pose.error());
  PartialTransform parts;
  if ((given & kRotation) != 0) parts.rotation = pose->rotation();
  if ((given & kTranslation) != 0) parts.translation = pose->translation();
  if ((given & kCovariance) == 0) return parts;
  if (is_pose_only(in)) {
    parts.covariance = StatedCovariance::unspecified();
    return parts;
  }
  const auto covariance = read_covariance(in, kPoseNumbers);
  if (!covariance) return at_frame(covariance.error());
  parts.covariance = *covariance;
  return parts;
}

wire::PartialEdge wire_partial(const PartialUpdate& edge) {
  wire::PartialEdge out;
  out.id(edge.id);
  out.parts(write_parts(edge.X_PC, out.x_pc()));
  return out;
}

Result<PartialUpdate> read_partial(const wire::PartialEdge& in) {
  std::string id = string_of(in.id());
  if (auto ok = check_id(id, "id"); !ok) return tl::unexpected(std::move(ok.error()));
  auto parts = read_parts(in.parts(), in.x_pc(), id);
  if (!parts) return tl::unexpected(std::move(parts.error()));
  return PartialUpdate{std::move(id), *std::move(parts)};
}

}  // namespace tfdude::fastdds
