#include "support/series.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <utility>

#include <nlohmann/json.hpp>

namespace bench {
namespace {

// Of sorted values; the nearest rank.
double quantile(const std::vector<double>& sorted, double share) {
  const double rank = std::ceil(share * static_cast<double>(sorted.size()));
  return sorted[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

}  // namespace

void Series::end_repetition() {
  std::vector<double> values(values_.begin() + static_cast<std::ptrdiff_t>(begin_), values_.end());
  begin_ = values_.size();
  if (values.empty()) return;
  std::sort(values.begin(), values.end());
  medians_.push_back(quantile(values, 0.5));
}

void Series::print() const {
  nlohmann::json line{{"key", key_}, {"unit", unit_}, {"n", values_.size()}, {"medians", medians_}};
  if (!values_.empty()) {
    std::vector<double> sorted = values_;
    std::sort(sorted.begin(), sorted.end());
    constexpr std::pair<const char*, double> kQuantiles[] = {
        {"min", 0.0}, {"p5", 0.05},  {"p25", 0.25}, {"median", 0.5},  {"p75", 0.75},
        {"p90", 0.9}, {"p95", 0.95}, {"p99", 0.99}, {"p99.9", 0.999}, {"max", 1.0}};
    for (const auto& [name, share] : kQuantiles) line[name] = quantile(sorted, share);
    line["mean"] =
        std::accumulate(sorted.begin(), sorted.end(), 0.0) / static_cast<double>(sorted.size());
  }
  std::puts(line.dump().c_str());
  std::fflush(stdout);
}

}  // namespace bench
