#include "math/left_columns.hpp"

#include "math/instant_sources.hpp"

namespace tfdude {

bool is_left(const JointPrior::Source& source) {
  return is_observed({source.name, false, {}}) && said_source(source.name).empty();
}

Eigen::Index many_left_columns(const JointPrior& prior) {
  Eigen::Index count = 0;
  for (const JointPrior::Source& source : prior.sources()) {
    if (!is_left(source)) continue;
    if (source.subtracts) return 0;
    count += source.loadings.front().cols();
  }
  return count > kMaxLoadingColumns ? count : 0;
}

Eigen::MatrixXd left_columns(const JointPrior& prior, Eigen::Index count) {
  Eigen::MatrixXd all(6 * static_cast<Eigen::Index>(prior.edges().size()), count);
  Eigen::Index first = 0;
  for (const JointPrior::Source& source : prior.sources()) {
    if (!is_left(source)) continue;
    const Eigen::Index columns = source.loadings.front().cols();
    Eigen::Index row = 0;
    for (const Loading& loading : source.loadings) {
      all.block(row, first, 6, columns) = loading;
      row += 6;
    }
    first += columns;
  }
  return all;
}

}  // namespace tfdude
