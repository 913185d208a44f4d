#include "transport/fastdds/codec_values.hpp"

#include <algorithm>
#include <string>

#include "tfdude/base/id.hpp"

#include "math/flat.hpp"

namespace tfdude::fastdds {
namespace {

Result<void> check_size(const Numbers& in) {
  if (in.size() == std::tuple_size_v<Flat> || is_pose_only(in)) return {};
  return fail(Errc::kInvalidInput, "a transform of " + std::to_string(in.size()) + " numbers");
}

}  // namespace

void write_transform(const Transform& X, Numbers& out) {
  if (!X.covariance.complete()) return write_pose(X.pose, out);
  write_numbers(X, out);
}

void write_numbers(const Transform& X, Numbers& out) {
  const Flat flat = to_flat(X);
  out.assign(flat.begin(), flat.end());
}

void write_pose(const Pose& pose, Numbers& out) {
  const Flat flat = to_flat({pose, Covariance()});
  out.assign(flat.begin(), flat.begin() + kPoseNumbers);
}

bool is_pose_only(const Numbers& in) { return in.size() == kPoseNumbers; }

Result<Transform> read_transform(const Numbers& in, std::string_view frame) {
  // Names the place only where something is wrong: most transforms are right.
  const auto at_frame = [&](const Error& error) { return fail_at("frame " + quote(frame), error); };
  if (auto ok = check_size(in); !ok) return at_frame(ok.error());
  const auto pose =
      Pose::create(Eigen::Quaterniond(in[3], in[0], in[1], in[2]), {in[4], in[5], in[6]});
  if (!pose) return at_frame(pose.error());
  if (is_pose_only(in)) return Transform{*pose, StatedCovariance::unspecified()};
  const auto covariance = read_covariance(in, kPoseNumbers);
  if (!covariance) return at_frame(covariance.error());
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

Result<Covariance> read_covariance(const Numbers& in, std::size_t first) {
  Covariance::Upper upper{};
  const std::size_t count = in.size() - std::min(first, in.size());
  if (count != upper.size()) {
    return fail(Errc::kInvalidInput, "a covariance of " + std::to_string(count) + " numbers");
  }
  std::copy_n(in.end() - Covariance::kSize, Covariance::kSize, upper.begin());
  return Covariance::from_upper(upper);
}

}  // namespace tfdude::fastdds
