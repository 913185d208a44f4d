#include "transport/fastdds/codec_correlation.hpp"

#include <algorithm>
#include <utility>

namespace tfdude::fastdds {

Result<PathCorrelation> read_path_correlation(const wire::Correlation& body) {
  PathCorrelation correlation;
  const std::vector<double>& part = body.unknown_part();
  if (!part.empty()) {
    if (part.size() != Covariance::kSize) {
      return fail(Errc::kInvalidInput,
                  "a covariance of " + std::to_string(part.size()) + " numbers");
    }
    Covariance::Upper upper{};
    std::copy(part.begin(), part.end(), upper.begin());
    correlation.unknown = Covariance::trusted(upper);
    if (auto ok = check_finite({Pose(), *correlation.unknown}); !ok)
      return tl::unexpected(ok.error());
  }
  for (const wire::CommonError& in : body.common_errors()) {
    const std::vector<double>& numbers = in.loading();
    if (numbers.size() % 6 != 0) {
      return fail(Errc::kInvalidInput,
                  "a loading of " + std::to_string(numbers.size()) + " numbers");
    }
    const auto columns = static_cast<Eigen::Index>(numbers.size() / 6);
    correlation.common_errors.push_back({string_of(in.source()), in.subtracts() != 0,
                                         Eigen::Map<const Loading>(numbers.data(), 6, columns)});
  }
  if (auto ok = check_common_errors(correlation.common_errors); !ok)
    return tl::unexpected(ok.error());
  for (const wire::Identifier& id : body.observed_with())
    correlation.observed_with.push_back(string_of(id));
  return correlation;
}

Result<Correlation> read_correlation(const wire::Correlation& body) {
  auto correlation = read_path_correlation(body);
  if (!correlation) return tl::unexpected(std::move(correlation.error()));
  return Correlation{body.unknown() != 0, std::move(correlation->common_errors),
                     std::move(correlation->observed_with)};
}

}  // namespace tfdude::fastdds
