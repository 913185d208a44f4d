#include "explanation.hpp"

#include <algorithm>
#include <cmath>

#include "tfdude/base/id.hpp"

#include "format.hpp"
#include "json.hpp"
#include "text.hpp"

namespace tfdude::cli {
namespace {

std::string line(const char* what, const std::string& text) {
  return format("%-13s", what) + text + "\n";
}

std::string deviation(double variance, bool is_rotation) {
  const double sigma = std::sqrt(std::max(variance, 0.0));
  return is_rotation ? format("%.3f deg", sigma * kDegrees) : format("%.3f mm", sigma * 1e3);
}

std::string shares(const char* what, const std::vector<VarianceShare>& all, bool is_rotation) {
  constexpr std::size_t kMost = 10;
  std::string text;
  for (std::size_t i = 0; i < std::min(all.size(), kMost); ++i) {
    const VarianceShare& one = all[i];
    text += line(i == 0 ? what : "",
                 format("%5.1f %%  %12s  %s", 100 * one.share,
                        deviation(one.variance, is_rotation).c_str(), one.name.c_str()));
  }
  if (all.size() > kMost) text += line("", std::to_string(all.size() - kMost) + " more");
  return text;
}

std::string cause_text(const Cause& cause) {
  std::string text = line("no answer", cause.error.message);
  std::string what = to_string(cause.obstacle);
  std::replace(what.begin(), what.end(), '_', ' ');
  if (!cause.frame.empty()) what += ": frame " + quote(cause.frame);
  if (!cause.partition.empty()) what += " of partition " + quote(cause.partition);
  text += line("cause", what);
  if (cause.since) text += line("since", readable(*cause.since));
  if (!cause.needs.empty()) text += line("needs", cause.needs);
  if (!cause.similar.empty()) text += line("did you mean", joined(cause.similar) + "?");
  return text;
}

nlohmann::json shares_json(const std::vector<VarianceShare>& all) {
  nlohmann::json list = nlohmann::json::array();
  for (const VarianceShare& one : all) {
    list.push_back({{"name", one.name}, {"variance", one.variance}, {"share", one.share}});
  }
  return list;
}

nlohmann::json count_json(const std::optional<std::chrono::nanoseconds>& duration) {
  return duration ? nlohmann::json(duration->count()) : nlohmann::json();
}

nlohmann::json cause_json(const Cause& cause) {
  nlohmann::json json{{"obstacle", to_string(cause.obstacle)},
                      {"frame", cause.frame},
                      {"partition", cause.partition},
                      {"since_ns", ns_json(cause.since)},
                      {"needs", cause.needs},
                      {"similar", cause.similar},
                      {"clock_ahead_ns", count_json(cause.clock_ahead)},
                      {"code", to_string(cause.error.code)},
                      {"message", cause.error.message}};
  return json;
}

}  // namespace

std::string describe(const std::string& a, const std::string& b, const Explanation& why) {
  if (why.cause) return cause_text(*why.cause);
  const Eigen::Vector3d& d = why.direction;
  const char* where =
      why.is_rotation ? "about the axis (%.3f, %.3f, %.3f) of " : "along (%.3f, %.3f, %.3f) of ";
  std::string text = line("std dev", deviation(why.variance, why.is_rotation) + " " +
                                         format(where, d.x(), d.y(), d.z()) +
                                         (why.is_rotation ? b : a) + ", the largest");
  text += shares("edges", why.edges, why.is_rotation);
  text += shares("sources", why.sources, why.is_rotation);
  text += shares("joints", why.joints, why.is_rotation);
  if (why.best) {
    text += line("best", "measuring " + why.best->b + " in " + why.best->a + " would leave " +
                             deviation(why.best->variance_after, why.is_rotation));
  }
  const std::vector<std::string>& unspecified = why.X_AB->basis.unspecified;
  if (!unspecified.empty()) text += line("unspecified", joined(unspecified));
  if (!why.assumed_joints.empty()) text += line("assumed", joined(why.assumed_joints));
  if (why.X_AB->basis.bound) text += line("bound", "edges of unknown correlation are left out");
  for (std::size_t i = 0; i < why.owners.size(); ++i) {
    const OwnerAge& owner = why.owners[i];
    std::string age = owner.newest ? ": newest of " + owner.slowest + " " : ": static";
    if (owner.age) age += readable(*owner.age) + " old";
    if (!owner.age && owner.newest) age += "of " + readable(*owner.newest);
    text += line(i == 0 ? "owners" : "", owner.partition + age);
    if (owner.clock_ahead) text += line("", clock_hint(owner.partition, *owner.clock_ahead));
  }
  return text;
}

nlohmann::json why_json(const std::string& a, const std::string& b, const Explanation& why) {
  nlohmann::json owners = nlohmann::json::array();
  for (const OwnerAge& one : why.owners) {
    owners.push_back({{"partition", one.partition},
                      {"reachable", one.reachable},
                      {"slowest", one.slowest},
                      {"newest_ns", ns_json(one.newest)},
                      {"age_ns", count_json(one.age)},
                      {"clock_ahead_ns", count_json(one.clock_ahead)}});
  }
  nlohmann::json json{{"from", a},
                      {"to", b},
                      {"cause", why.cause ? cause_json(*why.cause) : nlohmann::json()},
                      {"direction", numbers_json(why.direction)},
                      {"is_rotation", why.is_rotation},
                      {"variance", why.variance},
                      {"edges", shares_json(why.edges)},
                      {"sources", shares_json(why.sources)},
                      {"joints", shares_json(why.joints)},
                      {"best", nullptr},
                      {"unspecified", nlohmann::json::array()},
                      {"assumed_joints", why.assumed_joints},
                      {"owners", owners}};
  if (why.best) {
    json["best"] = {
        {"from", why.best->a}, {"to", why.best->b}, {"variance_after", why.best->variance_after}};
  }
  if (why.X_AB) json["unspecified"] = why.X_AB->basis.unspecified;
  return json;
}

}  // namespace tfdude::cli
