#include "runtime/told_samples.hpp"

#include <algorithm>
#include <functional>
#include <type_traits>

namespace tfdude {
namespace {

std::size_t hash_of(const Transform& X, const Correlation& correlation) {
  std::size_t hash = 0;
  const auto add = [&hash](const auto& part) {
    hash = 31 * hash + std::hash<std::decay_t<decltype(part)>>()(part);
  };
  const Eigen::Matrix4d pose = X.pose.matrix();
  for (const double number : pose.reshaped()) add(number);
  for (const double number : X.covariance.of_specified().upper()) add(number);
  add(correlation.unknown);
  for (const CommonError& error : correlation.common_errors) {
    add(error.source);
    add(error.subtracts);
    for (const double number : error.loading.reshaped()) add(number);
  }
  for (const std::string& partner : correlation.observed_with) add(partner);
  return hash;
}

}  // namespace

std::vector<ToldSamples::Told>::iterator ToldSamples::place_of(Time stamp) {
  return std::lower_bound(told_.begin(), told_.end(), stamp,
                          [](const Told& one, Time at) { return one.stamp < at; });
}

void ToldSamples::add(Time stamp, std::uint64_t commit, const Transform& X,
                      const Correlation& correlation) {
  auto told = place_of(stamp);
  if (told == told_.end() || told->stamp != stamp) told = told_.emplace(told);
  *told = {stamp, commit, hash_of(X, correlation)};
  if (told_.size() >= 2 * kMost) told_.erase(told_.begin(), told_.end() - kMost);
}

bool ToldSamples::is_news(const PushedValue& sample, std::uint64_t commit, bool in_answer) {
  const auto told = place_of(*sample.stamp);
  if (told == told_.begin() && told != told_.end() && told->stamp > *sample.stamp) {
    return !in_answer || commit >= corrected_;
  }
  if (told == told_.end() || told->stamp != *sample.stamp) return true;
  if (commit <= told->commit) return false;
  told->commit = commit;
  return told->hash != hash_of(sample.X, sample.correlation);
}

// An answer also has the sample before the instant from which on it tells all.
void ToldSamples::keep_from(std::optional<Time> from) {
  auto kept = from ? place_of(*from) : told_.end();
  const bool is_after = kept == told_.end() || (from && kept->stamp > *from);
  if (from && is_after && kept != told_.begin()) --kept;
  told_.erase(told_.begin(), kept);
}

}  // namespace tfdude
