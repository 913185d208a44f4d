#include "store/correlation_blob.hpp"

#include <string_view>
#include <utility>

#include "tfdude/base/id.hpp"

#include "base/bytes.hpp"

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

Result<Correlation> correlation_from(const std::string& blob) {
  ByteReader in(blob);
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
  if (!valid || !in.good() || in.left() > 0) {
    return fail(Errc::kState, "a correlation of " + std::to_string(blob.size()) + " bytes");
  }
  if (auto ok = check_common_errors(correlation.common_errors); !ok)
    return tl::unexpected(std::move(ok.error()));
  for (const std::string& id : correlation.observed_with) {
    if (auto ok = check_id(id, "an edge observed with it"); !ok) return tl::unexpected(ok.error());
  }
  return correlation;
}

}  // namespace tfdude
