#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "tfdude/math/interpolate.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"

// Compares the forest with one that keeps everything in maps, searches them each time, and computes
// its limits independently.
namespace tfdude {
namespace {

using testing::outcome;
using testing::Random;
using testing::transform_diff;

struct Limits {
  std::int64_t span;
  std::size_t count;
};

struct Edge {
  std::string parent;
  Transform fixed;
  std::map<std::int64_t, Transform> samples;  // all that were taken
  Limits limits{};

  // The samples within the limits.
  std::map<std::int64_t, Transform> kept() const {
    std::map<std::int64_t, Transform> kept;
    for (auto one = samples.rbegin(); one != samples.rend() && kept.size() < limits.count; ++one) {
      if (one->first >= samples.rbegin()->first - limits.span) kept.insert(*one);
    }
    return kept;
  }
};

class Oracle {
 public:
  std::map<std::string, Edge> edges;

  std::string update(const std::string& id, const Transform& X, std::int64_t stamp) {
    Edge& edge = edges.at(id);
    const auto kept = edge.kept();
    if (!kept.empty() && stamp <= kept.rbegin()->first) {
      if (kept.count(stamp) > 0) return "stamp_taken";
      if (stamp < kept.rbegin()->first - edge.limits.span) return "too_old";
      if (kept.size() == edge.limits.count && stamp < kept.begin()->first) return "too_old";
    }
    edge.samples = kept;
    edge.samples[stamp] = X;
    return "ok";
  }

  std::string value(const std::string& id, std::int64_t t, Transform& X) const {
    const Edge& edge = edges.at(id);
    const auto kept = edge.kept();
    if (kept.empty()) {
      X = edge.fixed;
      return "ok";
    }
    if (t > kept.rbegin()->first) return "not_yet";
    if (t < kept.begin()->first) return "too_old";
    const auto after = kept.lower_bound(t);
    X = after->second;
    if (after->first == t) return "ok";
    const auto before = std::prev(after);
    const double s =
        static_cast<double>(t - before->first) / static_cast<double>(after->first - before->first);
    X = interpolate(before->second, after->second, s);
    return "ok";
  }

  std::vector<std::string> to_root(std::string id) const {
    std::vector<std::string> path{id};
    while (!edges.at(id).parent.empty()) path.push_back(id = edges.at(id).parent);
    return path;
  }

  // X_AB by way of where both paths meet.
  std::string lookup(const std::string& a, const std::string& b, std::optional<std::int64_t> when,
                     Transform& X_AB) const {
    auto up = to_root(a);
    auto down = to_root(b);
    while (!up.empty() && !down.empty() && up.back() == down.back()) {
      up.pop_back();
      down.pop_back();
    }
    std::vector<std::string> all(up);
    all.insert(all.end(), down.begin(), down.end());
    if (!when) {
      for (const std::string& id : all) {
        const auto& samples = edges.at(id).samples;
        if (samples.empty()) continue;
        when = std::min(when.value_or(INT64_MAX), samples.rbegin()->first);
      }
    }
    Transform X_MA = Transform::exact({});
    Transform X_MB = X_MA;
    for (auto* half : {&up, &down}) {
      Transform& X = half == &up ? X_MA : X_MB;
      for (auto id = half->rbegin(); id != half->rend(); ++id) {
        Transform edge;
        const std::string code = value(*id, when.value_or(0), edge);
        if (code != "ok") return "none";
        X = compose(X, edge);
      }
    }
    X_AB = between(X_MA, X_MB);
    return "ok";
  }
};

}  // namespace

TEST_CASE("100,000 lookups at random instants agree with an oracle that keeps everything") {
  Random random(90210);
  INFO("seed " << random.seed());
  constexpr int kFrames = 24;
  Oracle oracle;
  Forest forest;
  const auto id_of = [](std::size_t i) { return "f" + std::to_string(i); };
  for (std::size_t i = 0; i < kFrames; ++i) {
    const std::string parent = i == 0 ? "" : id_of(random.index(i));
    Edge edge{parent, random.transform(), {}, {}};
    EdgeTiming timing;
    timing.span = std::chrono::nanoseconds(1000 + random.index(4000));
    timing.count = 2 + random.index(40);
    edge.limits = {timing.span.count(), timing.count};
    REQUIRE(forest.add(id_of(i), parent, edge.fixed));
    REQUIRE(forest.set_timing(id_of(i), timing));
    oracle.edges.emplace(id_of(i), edge);
  }
  std::int64_t now = 10'000;
  int answered = 0;
  for (int lookups = 0; lookups < 100'000;) {
    now += static_cast<std::int64_t>(random.index(120));
    // Static ones stay so, the others move in batches of one stamp, sometimes late, far ahead or
    // twice.
    std::vector<EdgeUpdate> batch;
    std::int64_t stamp = now;
    const std::size_t kind = random.index(20);
    if (kind < 5) stamp -= static_cast<std::int64_t>(random.index(3000));
    if (kind == 5) stamp += 500;
    const std::size_t count = 1 + random.index(4);
    for (std::size_t i = 0; i < count; ++i) {
      const std::string id = id_of(random.index(kFrames * 3 / 4));
      const auto same = [&](const EdgeUpdate& edge) { return edge.id == id; };
      if (std::any_of(batch.begin(), batch.end(), same)) continue;
      batch.push_back({id, {random.pose(), random.covariance()}});
    }
    const Oracle before = oracle;
    std::string expected = "ok";
    for (const EdgeUpdate& edge : batch) {
      if (const auto code = oracle.update(edge.id, edge.X_PC, stamp); expected == "ok") {
        expected = code;
      }
    }
    if (expected != "ok") oracle = before;
    INFO("stamp " << stamp << " at " << now << ", " << batch.size() << " edges");
    REQUIRE(outcome(forest.update(batch, time_of(stamp))) == expected);
    for (int i = 0; i < 25; ++i, ++lookups) {
      const std::string a = id_of(random.index(kFrames));
      const std::string b = id_of(random.index(kFrames));
      std::optional<std::int64_t> when;
      if (random.index(4) > 0) when = now - static_cast<std::int64_t>(random.index(2500));
      Query query;
      if (when) query.at = time_of(*when);
      Transform X_AB = Transform::exact({});
      const std::string code = oracle.lookup(a, b, when, X_AB);
      const auto found = forest.lookup(a, b, query);
      INFO(a << " to " << b << " at " << (when ? std::to_string(*when) : "the newest") << ": "
             << outcome(found));
      REQUIRE((found ? "ok" : "none") == code);
      if (!found) continue;
      ++answered;
      REQUIRE(transform_diff(*found, X_AB, 1e-9, 1e-7) == "");
    }
  }
  CHECK(answered > 20'000);
}

}  // namespace tfdude
