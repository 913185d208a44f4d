#include "math/instant_sources.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "math/bound_weights.hpp"
#include "math/common_errors.hpp"

namespace tfdude {
namespace {

// Besides, there are the prefix, an observation's name or stamps, and a number.
constexpr std::size_t kMostBytes = 160;

constexpr char kOf = '=';
constexpr char kAt = '@';
constexpr char kBetween = '#';

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

// The errors of one source, by what may be correlated in any way.
class Sides {
 public:
  void add(std::string_view name, const Covariance& sigma) {
    const std::string_view side = side_of(name);
    const std::size_t k = find(side);
    if (k == names_.size()) {
      names_.push_back(side);
      sums_.emplace_back();
    }
    sums_[k] += sigma;
  }

  /// Once all are added. @return whether several are not zero
  [[nodiscard]] bool weigh() {
    weights_ = bound_weights(sums_);
    const auto counts = [](const Covariance& sigma) {
      return !(sigma.upper() == Covariance::Upper{});
    };
    return std::count_if(sums_.begin(), sums_.end(), counts) > 1;
  }
  /// By what the square of such an error counts.
  [[nodiscard]] double weight(std::string_view name) const { return weights_[find(side_of(name))]; }

 private:
  // What observations have left of several instants counts as independent.
  static std::string_view side_of(std::string_view name) {
    if (is_between_samples(name)) return name;
    return said_source(name).empty() ? std::string_view() : kObservedPrefix;
  }
  [[nodiscard]] std::size_t find(std::string_view side) const {
    return static_cast<std::size_t>(std::find(names_.begin(), names_.end(), side) - names_.begin());
  }

  std::vector<std::string_view> names_;
  std::vector<Covariance> sums_;
  std::vector<double> weights_;
};

bool is_of(std::string_view name, std::string_view said) {
  return said_source(name) == said || is_source_itself(name, said);
}

// Gives those between samples the name of their source. @return whether there were any
bool join_samples(const std::string& source, std::vector<CommonError>& errors) {
  bool any = false;
  for (CommonError& one : errors) {
    if (!is_between_samples(one.source)) continue;
    if (!is_source_itself(source, said_source(one.source))) continue;
    one.source = source;
    any = true;
  }
  return any;
}

}  // namespace

bool is_made(std::string_view name) { return name.rfind(kObservedPrefix, 0) == 0; }

std::string instant_source(std::string_view source, Time stamp) {
  return std::string(kObservedPrefix) + kAt + std::to_string(nanoseconds(stamp)) + kOf +
         shortened(source);
}

std::string source_between(std::string_view source, Time before, Time after) {
  return std::string(kObservedPrefix) + kBetween + std::to_string(nanoseconds(before)) + ',' +
         std::to_string(nanoseconds(after)) + kOf + shortened(source);
}

std::string stored_between(std::string_view source_between, Time at) {
  std::string name(source_between);
  name.insert(name.find(kOf), kAt + std::to_string(nanoseconds(at)));
  return name;
}

void store_between(Time at, std::vector<CommonError>& common_errors) {
  for (CommonError& one : common_errors) {
    if (is_of_two_samples(one.source)) one.source = stored_between(one.source, at);
  }
}

bool is_between_samples(std::string_view name) {
  return !said_source(name).empty() && name[kObservedPrefix.size()] == kBetween;
}

bool is_of_two_samples(std::string_view name) {
  return is_between_samples(name) && instant_in(name).empty();
}

std::string_view shown_source(std::string_view name) {
  return is_between_samples(name) ? said_source(name) : name;
}

std::string_view instant_in(std::string_view name) {
  if (!is_of_one_instant(name) && !is_between_samples(name)) return {};
  const std::string_view begin = name.substr(0, name.find(kOf));
  const std::size_t at = begin.find(kAt);
  return at == std::string_view::npos ? std::string_view() : begin.substr(at + 1);
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
  if (!is_made(name)) return {};
  const std::size_t of = name.find(kOf);
  return of == std::string_view::npos ? std::string_view() : name.substr(of + 1);
}

bool is_of_one_instant(std::string_view name) {
  return !said_source(name).empty() && name[kObservedPrefix.size()] == kAt;
}

bool is_source_itself(std::string_view name, std::string_view said) {
  return !is_made(name) && shortened(name) == said;
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
  if (any) add_up(common_errors);
  return any;
}

void join_lasting(const std::vector<ErrorsOfEdge>& edges) {
  const bool between = std::any_of(edges.begin(), edges.end(), [](const ErrorsOfEdge& edge) {
    return std::any_of(edge.errors->begin(), edge.errors->end(),
                       [](const CommonError& one) { return is_between_samples(one.source); });
  });
  if (!between) return;
  std::vector<std::string> lasting;
  for (const ErrorsOfEdge& edge : edges) {
    if (!edge.lasts) continue;
    for (const CommonError& one : *edge.errors) {
      if (said_source(one.source).empty()) lasting.push_back(one.source);
    }
  }
  for (const ErrorsOfEdge& edge : edges) {
    bool any = false;
    for (const std::string& source : lasting) any = join_samples(source, *edge.errors) || any;
    if (any) add_up(*edge.errors);
  }
}

std::vector<double> relation_weights(const std::vector<CommonError>& common_errors) {
  std::vector<double> weights;
  std::vector<std::string_view> done;
  for (const CommonError& first : common_errors) {
    const std::string_view said = said_source(first.source);
    if (said.empty() || std::count(done.begin(), done.end(), said) > 0) continue;
    done.push_back(said);
    Sides sides;
    for (const CommonError& one : common_errors) {
      if (!is_of(one.source, said)) continue;
      sides.add(one.source, Covariance::trusted(Matrix6d(one.loading * one.loading.transpose())));
    }
    if (!sides.weigh()) continue;
    weights.resize(common_errors.size(), 1.0);
    for (std::size_t i = 0; i < common_errors.size(); ++i) {
      const std::string& name = common_errors[i].source;
      if (is_of(name, said)) weights[i] = sides.weight(name);
    }
  }
  return weights;
}

bool allow_any_relation(std::vector<CommonError>& common_errors) {
  const std::vector<double> weights = relation_weights(common_errors);
  for (std::size_t i = 0; i < weights.size(); ++i) {
    common_errors[i].loading *= std::sqrt(weights[i]);
  }
  return !weights.empty();
}

Covariance sum_of_sources(const std::vector<OfSource>& parts, bool& bounded) {
  Covariance sum;
  std::vector<bool> taken(parts.size());
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const std::string_view said = said_source(parts[k].first);
    if (said.empty() || taken[k]) continue;
    Sides sides;
    for (const OfSource& one : parts) {
      if (is_of(one.first, said)) sides.add(one.first, one.second);
    }
    bounded = sides.weigh() || bounded;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (!is_of(parts[i].first, said)) continue;
      sum += Covariance::trusted(Matrix6d(sides.weight(parts[i].first) * parts[i].second.matrix()));
      taken[i] = true;
    }
  }
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (!taken[k]) sum += parts[k].second;
  }
  return sum;
}

}  // namespace tfdude
