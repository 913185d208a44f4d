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
  for (const wire::Share& in : body.shares()) {
    const std::vector<double>& numbers = in.factor();
    if (numbers.size() % 6 != 0) {
      return fail(Errc::kInvalidInput,
                  "a factor of " + std::to_string(numbers.size()) + " numbers");
    }
    const auto columns = static_cast<Eigen::Index>(numbers.size() / 6);
    correlation.shares.push_back({string_of(in.source()), in.subtracts() != 0,
                                  Eigen::Map<const Factor>(numbers.data(), 6, columns)});
  }
  if (auto ok = check_shares(correlation.shares); !ok) return tl::unexpected(ok.error());
  for (const wire::Identifier& id : body.observed_with())
    correlation.observed_with.push_back(string_of(id));
  return correlation;
}

Result<Correlation> read_correlation(const wire::Correlation& body) {
  auto correlation = read_path_correlation(body);
  if (!correlation) return tl::unexpected(std::move(correlation.error()));
  return Correlation{body.unknown() != 0, std::move(correlation->shares),
                     std::move(correlation->observed_with)};
}

}  // namespace tfdude::fastdds
