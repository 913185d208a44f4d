#include <algorithm>
#include <cstdlib>
#include <iterator>

#include "tfdude/base/id.hpp"

#include "commands.hpp"
#include "uncertainty_render.hpp"

// Commands for measurements and correlation.
namespace tfdude::cli {
namespace {

using Measure = Result<Observed> (*)(Client&, const Arguments&, const Transform&,
                                     std::optional<Time>);

int measure(Client& client, const Arguments& arguments, Measure take) {
  // A default of zero would mean an exact measurement, which is hardly intended.
  if (!arguments.spec.stddev && !arguments.spec.cov) {
    return report({Errc::kInvalidInput, "a measurement needs --stddev or --cov"}, arguments);
  }
  const auto X = arguments.spec.build();
  if (!X) return report({X.error().code, "the measurement: " + X.error().message}, arguments);
  const auto stamp = optional_stamp(client, arguments.stamp);
  if (!stamp) return report(stamp.error(), arguments);
  const auto observed = take(client, arguments, *X, *stamp);
  if (!observed) return refuse(client, observed.error(), arguments);
  (void)answer(arguments, observed_json(*observed), describe(*observed));
  return observed->accepted ? kDone : kRefused;
}

// The columns of one source form one loading, in the order in which they are given.
std::vector<CommonError> read_common_errors(const std::vector<std::string>& said,
                                            const AngleUnit& angles) {
  constexpr std::size_t kRows = kSourceSize - 1;
  std::vector<CommonError> common_errors;
  for (std::size_t at = 0; at + kRows < said.size(); at += kSourceSize) {
    const std::string& source = said[at];
    Twist column;
    for (std::size_t row = 0; row < kRows; ++row) {
      column[static_cast<Eigen::Index>(row)] = std::strtod(said[at + 1 + row].c_str(), nullptr);
    }
    column.tail<3>() /= angles.per_radian;
    auto common_error = std::find_if(common_errors.begin(), common_errors.end(),
                                     [&](const CommonError& one) { return one.source == source; });
    if (common_error == common_errors.end()) {
      common_errors.push_back({source, false, Loading(kRows, 0)});
      common_error = std::prev(common_errors.end());
    }
    common_error->loading.conservativeResize(Eigen::NoChange, common_error->loading.cols() + 1);
    common_error->loading.rightCols<1>() = column;
  }
  return common_errors;
}

}  // namespace

int run_correlate(Client& client, const Arguments& arguments) {
  const Correlation said{
      arguments.unknown, read_common_errors(arguments.sources, arguments.angles), {}};
  return finish(client, client.correlate(arguments.id, said), arguments, "correlated");
}

int run_observe(Client& client, const Arguments& arguments) {
  return measure(
      client, arguments,
      [](Client& to, const Arguments& said, const Transform& X, std::optional<Time> stamp) {
        return to.observe(said.id, said.other, X, stamp, said.observe);
      });
}

int run_fuse(Client& client, const Arguments& arguments) {
  return measure(
      client, arguments,
      [](Client& to, const Arguments& said, const Transform& X, std::optional<Time> stamp) {
        return to.fuse(said.id, X, stamp, said.observe);
      });
}

}  // namespace tfdude::cli
