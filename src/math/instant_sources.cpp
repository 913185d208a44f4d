#include "math/instant_sources.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "math/bound_weights.hpp"
#include "math/common_errors.hpp"

namespace tfdude {
namespace {

// Besides, there are the prefix, an observation's name or a stamp, and a number.
constexpr std::size_t kMostBytes = 160;

constexpr char kOf = '=';
constexpr char kAt = '@';

// By a name that differs from others that begin so.
std::string shortened(std::string_view source) {
  if (source.size() <= kMostBytes) return std::string(source);
  std::size_t bytes = kMostBytes - std::numeric_limits<std::size_t>::digits10 - 2;
  const auto continues = [&](std::size_t i) {
    return (static_cast<unsigned char>(source[i]) & 0xc0U) == 0x80U;  // of a code point
  };
  while (bytes > 0 && continues(bytes)) --bytes;
  return std::string(source.substr(0, bytes)) + '~' +
         std::to_string(std::hash<std::string_view>()(source));
}

// Of two parts, those named as `said` itself and those of its instants.
struct Sides {
  Covariance itself;
  Covariance of_instants;
};

bool is_without_loading(const Covariance& sigma) { return sigma.upper() == Covariance::Upper{}; }

}  // namespace

std::string instant_source(std::string_view source, Time stamp) {
  return std::string(kObservedPrefix) + kAt + std::to_string(nanoseconds(stamp)) + kOf +
         shortened(source);
}

std::string merged_source(std::string_view observation, std::string_view source) {
  return std::string(observation) + kOf + shortened(source);
}

std::string as_merged(std::string_view of_one_instant) {
  std::string name(of_one_instant);
  name.erase(kObservedPrefix.size(), 1);
  return name;
}

std::string_view said_source(std::string_view name) {
  if (name.rfind(kObservedPrefix, 0) != 0) return {};
  const std::size_t of = name.find(kOf);
  return of == std::string_view::npos ? std::string_view() : name.substr(of + 1);
}

bool is_of_one_instant(std::string_view name) {
  return !said_source(name).empty() && name[kObservedPrefix.size()] == kAt;
}

bool is_source_itself(std::string_view name, std::string_view said) {
  return name.rfind(kObservedPrefix, 0) != 0 && shortened(name) == said;
}

bool has_instants(const std::vector<CommonError>& common_errors) {
  return std::any_of(common_errors.begin(), common_errors.end(),
                     [](const CommonError& one) { return !said_source(one.source).empty(); });
}

bool join_instant(std::vector<CommonError>& common_errors, Time stamp) {
  bool any = false;
  for (CommonError& one : common_errors) {
    if (!is_of_one_instant(one.source)) continue;
    const std::string said(said_source(one.source));
    if (one.source != instant_source(said, stamp)) continue;
    const auto source = std::find_if(
        common_errors.begin(), common_errors.end(),
        [&](const CommonError& other) { return is_source_itself(other.source, said); });
    if (source == common_errors.end()) continue;
    one.source = source->source;
    any = true;
  }
  if (!any) return false;
  std::vector<CommonError> joined;
  add_errors(common_errors, joined);
  common_errors = std::move(joined);
  return true;
}

bool allow_any_relation(std::vector<CommonError>& common_errors) {
  std::vector<std::string> done;
  bool any = false;
  for (std::size_t k = 0; k < common_errors.size(); ++k) {
    const std::string said(said_source(common_errors[k].source));
    if (said.empty() || std::count(done.begin(), done.end(), said) > 0) continue;
    done.push_back(said);
    Sides sides;
    const auto each = [&](const auto& take) {
      for (CommonError& one : common_errors) {
        if (said_source(one.source) == said) take(one, sides.of_instants, false);
        if (is_source_itself(one.source, said)) take(one, sides.itself, true);
      }
    };
    each([](const CommonError& one, Covariance& side, bool) {
      side += Covariance::trusted(Matrix6d(one.loading * one.loading.transpose()));
    });
    if (is_without_loading(sides.itself) || is_without_loading(sides.of_instants)) continue;
    const BoundWeights weights = bound_weights(sides.itself, sides.of_instants);
    each([&](CommonError& one, Covariance&, bool itself) {
      one.loading *= std::sqrt(itself ? weights.of_A : weights.of_B);
    });
    any = true;
  }
  return any;
}

Covariance sum_of_sources(const std::vector<OfSource>& parts, bool& bounded) {
  Covariance sum;
  std::vector<bool> taken(parts.size());
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const std::string_view said = said_source(parts[k].first);
    if (said.empty() || taken[k]) continue;
    Sides sides;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const bool itself = is_source_itself(parts[i].first, said);
      if (!itself && said_source(parts[i].first) != said) continue;
      (itself ? sides.itself : sides.of_instants) += parts[i].second;
      taken[i] = true;
    }
    bounded =
        bounded || !(is_without_loading(sides.itself) || is_without_loading(sides.of_instants));
    sum += bound(sides.itself, sides.of_instants);
  }
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (!taken[k]) sum += parts[k].second;
  }
  return sum;
}

}  // namespace tfdude
