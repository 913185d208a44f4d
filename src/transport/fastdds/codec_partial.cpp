#include "transport/fastdds/codec_partial.hpp"

#include <algorithm>

#include "tfdude/base/id.hpp"

#include "math/flat.hpp"
#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/codec_correlation.hpp"

namespace tfdude::fastdds {
namespace {

// Bits of wire::PartialEdge::parts.
enum Part : std::uint8_t { kTranslation = 1, kRotation = 2, kCovariance = 4 };

}  // namespace

wire::PartialEdge wire_partial(const PartialUpdate& edge) {
  const Pose pose = Pose::trusted(edge.rotation.value_or(Eigen::Quaterniond::Identity()),
                                  edge.translation.value_or(Eigen::Vector3d::Zero()));
  wire::PartialEdge out;
  out.id(edge.id);
  out.parts(static_cast<std::uint8_t>((edge.translation ? kTranslation : 0) |
                                      (edge.rotation ? kRotation : 0) |
                                      (edge.covariance ? kCovariance : 0)));
  out.x_pc(to_flat({pose, edge.covariance.value_or(Covariance())}));
  return out;
}

Result<PartialUpdate> read_partial(const wire::PartialEdge& in) {
  PartialUpdate edge{string_of(in.id())};
  if (auto ok = check_id(edge.id, "id"); !ok) return tl::unexpected(std::move(ok.error()));
  const auto& x = in.x_pc();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  if ((in.parts() & kRotation) != 0) rotation = Eigen::Quaterniond(x[3], x[0], x[1], x[2]);
  if ((in.parts() & kTranslation) != 0) translation = {x[4], x[5], x[6]};
  const auto pose = Pose::create(rotation, translation);
  if (!pose) return fail_at("frame " + quote(edge.id), pose.error());
  if ((in.parts() & kRotation) != 0) edge.rotation = pose->rotation();
  if ((in.parts() & kTranslation) != 0) edge.translation = pose->translation();
  if ((in.parts() & kCovariance) == 0) return edge;
  Covariance::Upper upper{};
  std::copy_n(x.begin() + 7, Covariance::kSize, upper.begin());
  const auto covariance = Covariance::from_upper(upper);
  if (!covariance) return fail_at("frame " + quote(edge.id), covariance.error());
  edge.covariance = *covariance;
  return edge;
}

}  // namespace tfdude::fastdds
