#include "transport/fastdds/codec_values.hpp"

#include <algorithm>
#include <string>

#include "tfdude/base/id.hpp"

#include "math/flat.hpp"

namespace tfdude::fastdds {
namespace {

Result<void> check_size(const Numbers& in) {
  if (in.size() == std::tuple_size_v<Flat>) return {};
  if (is_pose_only(in)) {
    return fail(Errc::kUnsupported,
                "its covariance is unspecified, which this version does not support");
  }
  return fail(Errc::kInvalidInput, "a transform of " + std::to_string(in.size()) + " numbers");
}

}  // namespace

void write_transform(const Transform& X, Numbers& out) {
  const Flat flat = to_flat(X);
  out.assign(flat.begin(), flat.end());
}

void write_pose(const Pose& pose, Numbers& out) {
  const Flat flat = to_flat({pose, Covariance()});
  out.assign(flat.begin(), flat.begin() + kPoseNumbers);
}

Numbers numbers_of(const Transform& X) {
  Numbers out;
  write_transform(X, out);
  return out;
}

bool is_pose_only(const Numbers& in) { return in.size() == kPoseNumbers; }

Result<Transform> read_transform(const Numbers& in, std::string_view frame) {
  const std::string place = "frame " + quote(frame);
  if (auto ok = check_size(in); !ok) return fail_at(place, ok.error());
  const auto pose =
      Pose::create(Eigen::Quaterniond(in[3], in[0], in[1], in[2]), {in[4], in[5], in[6]});
  if (!pose) return fail_at(place, pose.error());
  const auto covariance = read_covariance({in.begin() + kPoseNumbers, in.end()}, place);
  if (!covariance) return tl::unexpected(covariance.error());
  return Transform{*pose, *covariance};
}

Result<Transform> read_computed(const Numbers& in) {
  if (auto ok = check_size(in); !ok) return tl::unexpected(std::move(ok.error()));
  Flat flat{};
  std::copy(in.begin(), in.end(), flat.begin());
  return computed_from(flat);
}

Result<Transform> read_computed_pose(const Numbers& in) {
  Flat flat{};
  std::copy_n(in.begin(), std::min(in.size(), kPoseNumbers), flat.begin());
  return computed_from(flat);
}

Result<Covariance> read_covariance(const Numbers& upper, const std::string& what) {
  Covariance::Upper numbers{};
  if (upper.size() != numbers.size()) {
    return fail(Errc::kInvalidInput,
                what + ": a covariance of " + std::to_string(upper.size()) + " numbers");
  }
  std::copy(upper.begin(), upper.end(), numbers.begin());
  const auto covariance = Covariance::from_upper(numbers);
  if (!covariance) return fail_at(what, covariance.error());
  return *covariance;
}

}  // namespace tfdude::fastdds
