#include "store/correlation_blob.hpp"

#include <string_view>
#include <utility>

#include "tfdude/base/id.hpp"

#include "base/bytes.hpp"
#include "math/flat.hpp"

namespace tfdude {

std::string to_blob(const Correlation& correlation) {
  std::string blob;
  ByteWriter out(blob);
  const auto count = [&](auto value) { out.u32(static_cast<std::uint32_t>(value)); };
  out.u8(correlation.unknown ? 1 : 0);
  count(correlation.common_errors.size());
  for (const CommonError& common_error : correlation.common_errors) {
    out.text(common_error.source);
    out.u8(common_error.subtracts ? 1 : 0);
    count(common_error.loading.cols());
    for (const double number : common_error.loading.reshaped()) out.f64(number);
  }
  count(correlation.observed_with.size());
  for (const std::string& id : correlation.observed_with) out.text(id);
  return blob;
}

namespace {

constexpr std::size_t kBytesOfPose = 7 * sizeof(double);

tl::unexpected<Error> bad_size(std::size_t size) {
  return fail(Errc::kState, "a correlation of " + std::to_string(size) + " bytes");
}

Result<Correlation> read_correlation(ByteReader& in, std::size_t size) {
  bool valid = true;
  // No greater number is valid.
  const auto up_to = [&valid](std::size_t most, std::uint32_t number) {
    valid = valid && number <= most;
    return valid ? number : 0;
  };
  Correlation correlation;
  correlation.unknown = up_to(1, in.u8()) != 0;
  for (auto left = up_to(kMaxCommonErrors, in.u32()); left > 0; --left) {
    CommonError& common_error = correlation.common_errors.emplace_back();
    common_error.source = in.text();
    common_error.subtracts = up_to(1, in.u8()) != 0;
    common_error.loading.resize(Eigen::NoChange, up_to(kMaxLoadingColumns, in.u32()));
    for (double& number : common_error.loading.reshaped()) number = in.f64();
  }
  for (auto left = up_to(kMaxCommonErrors, in.u32()); left > 0; --left) {
    correlation.observed_with.emplace_back(in.text());
  }
  if (!valid || !in.good()) return bad_size(size);
  if (auto ok = check_common_errors(correlation.common_errors); !ok)
    return tl::unexpected(std::move(ok.error()));
  for (const std::string& id : correlation.observed_with) {
    if (auto ok = check_id(id, "an edge observed with it"); !ok) return tl::unexpected(ok.error());
  }
  return correlation;
}

}  // namespace

Result<Correlation> correlation_from(const std::string& blob) {
  ByteReader in(blob);
  auto correlation = read_correlation(in, blob.size());
  if (correlation && in.left() > 0) return bad_size(blob.size());
  return correlation;
}

std::string observed_blob(const StoredCorrelation& correlation) {
  if (!correlation.observed) return {};
  std::string blob = to_blob(*correlation.observed);
  if (!correlation.given) return blob;
  ByteWriter out(blob);
  const Eigen::Quaterniond rotation = correlation.given->rotation();
  const Eigen::Vector3d translation = correlation.given->translation();
  for (const double number : rotation.coeffs()) out.f64(number);
  for (const double number : translation) out.f64(number);
  return blob;
}

Result<void> read_observed(const std::string& blob, StoredCorrelation& correlation) {
  ByteReader in(blob);
  auto observed = read_correlation(in, blob.size());
  if (!observed) return tl::unexpected(std::move(observed.error()));
  correlation.observed = *std::move(observed);
  if (in.left() == 0) return {};
  if (in.left() != kBytesOfPose) return bad_size(blob.size());
  Eigen::Quaterniond rotation;
  Eigen::Vector3d translation;
  for (double& number : rotation.coeffs()) number = in.f64();
  for (double& number : translation) number = in.f64();
  const auto given = computed_pose(rotation, translation);
  if (!given) return fail_at("the pose as it was given", given.error());
  correlation.given = *given;
  return {};
}

}  // namespace tfdude
