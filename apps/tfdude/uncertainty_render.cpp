#include "uncertainty_render.hpp"

#include <cmath>
#include <string_view>

#include "tfdude/base/id.hpp"
#include "tfdude/math/belief.hpp"

#include "format.hpp"
#include "render.hpp"
#include "table.hpp"
#include "terminal.hpp"
#include "time_render.hpp"

namespace tfdude::cli {
namespace {

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

// The factor by which the edge's variance should be larger.
double factor_of(const EdgeConsistency& edge) {
  return edge.sum.expected > 0 ? edge.sum.squares / edge.sum.expected : 0.0;
}

// The difference of the squares from their expected value, in standard deviations.
double deviation_of(const EdgeConsistency& edge) {
  if (!(edge.sum.variance > 0)) return 0.0;
  return (edge.sum.squares - edge.sum.expected) / std::sqrt(edge.sum.variance);
}

// If the covariances are right, one verdict in a hundred is not "agrees".
const char* verdict_of(const EdgeConsistency& edge) {
  constexpr double kBeyondChance = 2.576;
  const double deviation = deviation_of(edge);
  if (deviation > kBeyondChance) return "too small";
  return deviation < -kBeyondChance ? "too large" : "agrees";
}

}  // namespace

std::string describe(const Basis& basis) {
  // Sources with a name that somebody gave, and those that observations have left.
  std::vector<std::string> named;
  for (const std::string& source : basis.sources) {
    if (source.rfind(kObservedPrefix, 0) != 0) named.push_back(quote(source));
  }
  std::string text;
  const auto add = [&text](const std::string& line) {
    text += (text.empty() ? "correlation  " : "             ") + line + "\n";
  };
  if (!named.empty()) add("edges share the error of " + joined(named) + ", which is accounted for");
  if (named.size() < basis.sources.size()) {
    add("edges were corrected by one measurement, which is accounted for");
  }
  if (basis.bound) add("of some edges is not known: the std dev is an upper bound");
  return text + (basis.order == Order::kFourth ? "order        fourth\n" : "");
}

nlohmann::json basis_json(const Basis& basis) {
  return {{"order", static_cast<int>(basis.order)},
          {"bound", basis.bound},
          {"sources", basis.sources},
          {"unspecified", basis.unspecified}};
}

std::string describe(const Observed& observed) {
  std::string text = observed.accepted ? "accepted" : "rejected by the gate";
  text += format("     squared distance %.3f in %d dimensions", observed.distance_squared,
                 observed.dimensions);
  if (std::isfinite(observed.limit)) text += format(", limit %.3f", observed.limit);
  text += "\n";
  if (!observed.corrected.empty()) text += "corrected    " + joined(observed.corrected) + "\n";
  if (observed.accepted && observed.corrected.empty()) text += "corrected    nothing\n";
  return text;
}

nlohmann::json observed_json(const Observed& observed) {
  const auto finite = [](double value) {
    return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json();
  };
  nlohmann::json json{{"accepted", observed.accepted},
                      {"distance_squared", finite(observed.distance_squared)},
                      {"dimensions", observed.dimensions},
                      {"limit", finite(observed.limit)},
                      {"corrected", observed.corrected}};
  add_stamp(json, observed.stamp);
  return json;
}

std::string consistency_table(const std::vector<EdgeConsistency>& edges) {
  if (edges.empty()) return "";
  std::vector<std::string> ids;
  for (const EdgeConsistency& edge : edges) ids.push_back(edge.id);
  const std::size_t columns = name_width(ids, 22);
  const auto row = [&](const std::string& edge, const std::string& observed,
                       const std::string& rejected, const std::string& factor,
                       const std::string& deviations, const char* covariance) {
    return "  " + cell(edge, columns) +
           format(" %8s %8s %9s %10s  %s\n", observed.c_str(), rejected.c_str(), factor.c_str(),
                  deviations.c_str(), covariance);
  };
  std::string text = painted(Look::kHeader, row("observed edge", "observed", "rejected", "factor",
                                                "deviations", "covariance"));
  for (const EdgeConsistency& edge : edges) {
    const std::string_view agrees = "agrees";
    const std::string verdict =
        painted(verdict_of(edge) == agrees ? Look::kGood : Look::kWarning, verdict_of(edge));
    text += row(edge.id, number(static_cast<double>(edge.observations), 0, 8),
                number(static_cast<double>(edge.refused), 0, 8), number(factor_of(edge), 2, 9),
                number(deviation_of(edge), 1, 10), verdict.c_str());
  }
  return text;
}

nlohmann::json consistency_json(const EdgeConsistency& edge) {
  return {{"id", edge.id},
          {"observations", edge.observations},
          {"refused", edge.refused},
          {"variance_factor", factor_of(edge)},
          {"deviations", deviation_of(edge)},
          {"verdict", verdict_of(edge)}};
}

std::string describe(const Velocity& velocity, const Shown& shown) {
  const Eigen::Vector3d& v = velocity.linear;
  const Eigen::Vector3d& w = velocity.angular;
  const auto s = velocity.covariance.of_specified().stddev();
  std::string text = format("linear       %.6f  %.6f  %.6f  m/s\n", v.x(), v.y(), v.z());
  text += "angular      " + angles_text(w.x(), w.y(), w.z(), shown.angles, "/s") + "\n";
  const bool complete = velocity.covariance.complete();
  if (!complete) text += "std dev      " + unspecified_text(velocity.basis.unspecified) + "\n";
  text += (complete ? "std dev      " : "  of others  ") +
          format("%.6f  %.6f  %.6f  m/s\n", s[0], s[1], s[2]);
  text += "             " + angles_text(s[3], s[4], s[5], shown.angles, "/s") + "\n";
  if (shown.covariance) {
    text += format("covariance   %s(linear first; m/s, %s/s)\n", complete ? "" : "of the others ",
                   shown.angles.name);
    text += matrix_table(velocity.covariance.of_specified().matrix(), shown.angles);
  }
  if (velocity.begin && velocity.end) {
    text += "from         " + seconds_of(*velocity.begin) + "\nto           " +
            seconds_of(*velocity.end) + "\n";
  } else {
    text += "interval     none: all edges are static\n";
  }
  return text + describe(velocity.basis);
}

nlohmann::json velocity_json(const std::string& a, const std::string& b, const Velocity& velocity) {
  const Eigen::Vector3d& v = velocity.linear;
  const Eigen::Vector3d& w = velocity.angular;
  const auto ns = [](const std::optional<Time>& time) {
    return time ? nlohmann::json(nanoseconds(*time)) : nlohmann::json();
  };
  nlohmann::json json{{"from", a},
                      {"to", b},
                      {"linear", {v.x(), v.y(), v.z()}},
                      {"angular", {w.x(), w.y(), w.z()}},
                      {"begin_ns", ns(velocity.begin)},
                      {"end_ns", ns(velocity.end)},
                      {"basis", basis_json(velocity.basis)}};
  add_covariance(json, "covariance", velocity.covariance.of_specified().matrix(),
                 velocity.covariance.complete());
  return json;
}

}  // namespace tfdude::cli
