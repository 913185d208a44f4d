#include "transport/fastdds/codec_ties.hpp"

#include <algorithm>
#include <utility>

namespace tfdude::fastdds {

Result<Ties> read_ties(const wire::Correlation& body) {
  Ties ties;
  const std::vector<double>& part = body.unknown_part();
  if (!part.empty()) {
    if (part.size() != Covariance::kSize) {
      return fail(Errc::kInvalidInput,
                  "a covariance of " + std::to_string(part.size()) + " numbers");
    }
    Covariance::Upper upper{};
    std::copy(part.begin(), part.end(), upper.begin());
    ties.unknown = Covariance::trusted(upper);
    if (auto ok = check_finite({Pose(), *ties.unknown}); !ok) return tl::unexpected(ok.error());
  }
  for (const wire::Share& in : body.shares()) {
    const std::vector<double>& numbers = in.factor();
    if (numbers.size() % 6 != 0) {
      return fail(Errc::kInvalidInput,
                  "a factor of " + std::to_string(numbers.size()) + " numbers");
    }
    const auto columns = static_cast<Eigen::Index>(numbers.size() / 6);
    ties.shares.push_back({string_of(in.source()), in.subtracts() != 0,
                           Eigen::Map<const Factor>(numbers.data(), 6, columns)});
  }
  if (auto ok = check_shares(ties.shares); !ok) return tl::unexpected(ok.error());
  for (const wire::Identifier& id : body.observed_with())
    ties.observed_with.push_back(string_of(id));
  return ties;
}

Result<Correlation> read_correlation(const wire::Correlation& body) {
  auto ties = read_ties(body);
  if (!ties) return tl::unexpected(std::move(ties.error()));
  return Correlation{body.unknown() != 0, std::move(ties->shares), std::move(ties->observed_with)};
}

}  // namespace tfdude::fastdds
