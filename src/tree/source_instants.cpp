#include "tree/source_instants.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <system_error>

#include "tfdude/types/joint_spec.hpp"

#include "math/instant_sources.hpp"

namespace tfdude {
namespace {

// Of what an observation has left of a source's error at one instant.
std::optional<std::int64_t> stamp_of(const std::string& name) {
  if (!is_of_one_instant(name)) return std::nullopt;
  std::int64_t stamp = 0;
  const char* const begin = name.data() + kObservedPrefix.size() + 1;
  const auto read = std::from_chars(begin, name.data() + name.size(), stamp);
  return read.ec == std::errc() ? std::optional(stamp) : std::nullopt;
}

}  // namespace

SourceInstants::Source* SourceInstants::find(const std::string& name) {
  const auto is_it = [&](const Source& one) {
    return one.name == name || is_source_itself(one.name, name) || is_source_itself(name, one.name);
  };
  const auto found = std::find_if(sources_.begin(), sources_.end(), is_it);
  return found == sources_.end() ? nullptr : &*found;
}

void SourceInstants::note(const std::string& name, FromSamples from) {
  // Edges that one joint moves have their values from the same positions, whatever samples those
  // are told as.
  if (is_of_joints(name)) return;
  Source* source = find(name);
  if (source == nullptr) source = &sources_.emplace_back(Source{name, from});
  source->lasts = source->lasts || from == kLasting;
  source->differs = source->differs || !(from == source->first);
  source->between = source->between || !from.is_one();
}

const std::vector<CommonError>& SourceInstants::met(const std::vector<CommonError>& common_errors,
                                                    FromSamples from) {
  if (!naming_) {
    for (const CommonError& one : common_errors) {
      if (!is_made(one.source)) note(one.source, from);
      if (const auto stamp = stamp_of(one.source)) {
        note(std::string(said_source(one.source)), {*stamp, *stamp});
      }
    }
    return common_errors;
  }
  if (from.is_one()) return common_errors;
  named_ = common_errors;
  for (CommonError& one : named_) {
    const Source* source = find(one.source);
    if (source == nullptr || !source->is_named) continue;
    one.source = source_between(one.source, time_of(from.first), time_of(from.last));
  }
  return named_;
}

bool SourceInstants::begin_naming(bool part) {
  for (Source& one : sources_) {
    one.is_named = !one.lasts && one.between && (part || one.differs);
    naming_ = naming_ || one.is_named;
  }
  return naming_;
}

void fold_samples(PathCorrelation& correlation) {
  auto& errors = correlation.common_errors;
  if (errors.size() <= kMaxCommonErrors) return;
  const auto first = std::stable_partition(
      errors.begin(), errors.end(), [](const auto& one) { return !is_of_two_samples(one.source); });
  if (first == errors.end()) return;
  const Belief folded{{}, {}, {}, {first, errors.end()}, false};
  const Covariance sigma = collapse(folded).covariance.of_specified();
  errors.erase(first, errors.end());
  correlation.unknown = correlation.unknown ? bound(*correlation.unknown, sigma) : sigma;
}

}  // namespace tfdude
