#include <chrono>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "math/instant_sources.hpp"
#include "math/mean_velocity.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"
#include "tree/over_fixed.hpp"

// Edges that name one source, at instants of which not all have a sample. All is on one line, so
// that each error is a sum over the source's errors at the stamps.
namespace tfdude {
namespace {

using testing::Approx;
using testing::Random;

constexpr double kSize = 0.01;  // of the source [m]

Time at(double step) {
  return Time(std::chrono::nanoseconds(1'000'000'000 + std::llround(step * 100'000'000)));
}

Correlation supply() {
  Loading F = Loading::Zero(6, 1);
  F(0, 0) = kSize;
  return {false, {{"supply", false, F}}, {}};
}

class Line {
 public:
  Line() { REQUIRE(forest.add("world", "", {})); }

  void add(const std::string& id, const std::vector<double>& steps, bool drifts = false) {
    REQUIRE(forest.add(id, "world", Transform::exact({})));
    EdgeTiming timing;
    timing.drifts = drifts;
    if (!steps.empty()) REQUIRE(forest.set_timing(id, timing));
    REQUIRE(forest.correlate(id, supply()));
    for (const double step : steps) REQUIRE(forest.update(id, Transform::exact({}), at(step)));
  }
  [[nodiscard]] StampedTransform between(const std::string& a, const std::string& b,
                                         std::optional<double> step = {}) const {
    Query query;
    if (step) query.at = at(*step);
    query.extrapolate = std::chrono::seconds(1);
    const auto X = forest.lookup(a, b, query);
    REQUIRE(X);
    return *X;
  }
  [[nodiscard]] double sigma(const std::string& a, const std::string& b,
                             std::optional<double> step = {}) const {
    return std::sqrt(between(a, b, step).covariance.if_complete()->upper()[0]);
  }

  Forest forest{[] { return at(0); }};
};

// What the errors at the stamps contribute to the error at an instant.
using Shares = std::map<double, double>;

void add_shares(Shares& shares, const std::vector<double>& steps, double t, double sign) {
  std::size_t k = 1;
  while (k + 1 < steps.size() && steps[k] < t) ++k;
  const double s = (t - steps[k - 1]) / (steps[k] - steps[k - 1]);
  shares[steps[k - 1]] += sign * (1 - s);
  shares[steps[k]] += sign * s;
}

double independent(const Shares& shares) {
  double sum = 0;
  for (const auto& [step, share] : shares) sum += share * share;
  return kSize * std::sqrt(sum);
}

// Of errors of variance one that are related in some way.
double related(const Shares& shares, Random& random) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& [step, share] : shares) sum += share * random.direction();
  return kSize * sum.norm();
}

TEST_CASE("A source does not cancel between a sample and what is between others") {
  Line line;
  line.add("a", {0, 2});
  line.add("b", {0, 1, 2});
  const StampedTransform X = line.between("a", "b", 1);
  CHECK(std::sqrt(X.covariance.if_complete()->upper()[0]) == Approx(2 * kSize));
  CHECK(X.basis.bound);
  CHECK(X.basis.sources == std::vector<std::string>{"supply"});
  // At samples of one instant it does.
  CHECK(line.sigma("a", "b", 2) == Approx(0).margin(1e-9));
  CHECK_FALSE(line.between("a", "b", 2).basis.bound);
  CHECK(line.sigma("world", "a", 1) == Approx(kSize));
  CHECK_FALSE(line.between("world", "a", 1).basis.bound);
}

TEST_CASE("A source cancels between the same two samples, and beyond them") {
  Line line;
  line.add("a", {0, 1, 2});
  line.add("b", {0, 1, 2});
  for (const double step : {0.5, 1.25, 2.0, 2.5}) {
    INFO("step " << step);
    CHECK(line.sigma("a", "b", step) == Approx(0).margin(1e-9));
    CHECK_FALSE(line.between("a", "b", step).basis.bound);
  }
}

TEST_CASE("A source does not cancel beyond the samples of one edge") {
  Line line;
  line.add("a", {0, 1});
  line.add("b", {0, 1, 2});
  // Twice the error at 1, without that at 0, beside that at 2.
  CHECK(line.sigma("a", "b", 2) >= 4 * kSize - 1e-9);
  CHECK(line.between("a", "b", 2).basis.bound);
}

TEST_CASE("A source does not cancel at the latest common time of edges with other stamps") {
  Line line;
  line.add("a", {0, 2});
  line.add("b", {0, 1});
  CHECK(line.sigma("a", "b") == Approx(2 * kSize));
  CHECK(line.between("a", "b").basis.bound);
  const auto X = line.forest.lookup("a", "b");
  REQUIRE(X);
  CHECK(std::sqrt(X->covariance.if_complete()->upper()[0]) == Approx(2 * kSize));
}

TEST_CASE("A source that an edge of the path makes last is one error") {
  for (const bool drifts : {false, true}) {
    INFO((drifts ? "drifts" : "static"));
    Line line;
    line.add("a", {0, 2});
    line.add("c", drifts ? std::vector<double>{0, 1, 2} : std::vector<double>(), drifts);
    CHECK(line.sigma("a", "c", 1) == Approx(0).margin(1e-9));
    CHECK_FALSE(line.between("a", "c", 1).basis.bound);
  }
}

TEST_CASE("What an observation has left of an instant does not cancel between samples") {
  Line line;
  line.add("a", {0, 2});
  line.add("b", {0, 1, 2});
  line.add("c", {});
  Correlation left = supply();
  left.common_errors[0].source = instant_source("supply", at(1));
  REQUIRE(line.forest.correlate("c", left));
  CHECK(line.sigma("b", "c", 1) == Approx(0).margin(1e-9));
  CHECK(line.sigma("a", "c", 1) == Approx(2 * kSize));
  CHECK(line.between("a", "c", 1).basis.bound);
}

TEST_CASE("Parts of a path and single edges name what comes from two samples") {
  Line line;
  line.add("a", {0, 2});
  Query query;
  const auto name = [&](double step, bool edges) {
    query.at = at(step);
    const auto found = line.forest.lookup_segments({{"world", "a"}}, query, std::nullopt, edges);
    REQUIRE(found);
    return found->correlations.at(0).common_errors.at(0).source;
  };
  CHECK(name(1, false) == "observed:#1000000000,1200000000=supply");
  CHECK(name(2, false) == "supply");
  CHECK(name(1, true) == "observed:#1000000000,1200000000=supply");
  CHECK(name(2, true) == "supply");
}

TEST_CASE("No relation of a source's errors at several instants exceeds what a lookup claims") {
  Random random(7151);
  INFO("seed " << random.seed());
  for (int run = 0; run < 200; ++run) {
    Line line;
    std::vector<std::vector<double>> all;
    for (const char* id : {"a", "b"}) {
      std::vector<double>& steps = all.emplace_back();
      for (int step = 0; step < 6; ++step) {
        if (step == 0 || random.uniform(0, 1) < 0.5) steps.push_back(step);
      }
      if (steps.size() == 1) steps.push_back(6);
      line.add(id, steps);
    }
    const double t = 0.5 * static_cast<double>(random.index(13));
    Shares shares;
    add_shares(shares, all[0], t, -1);
    add_shares(shares, all[1], t, 1);
    const double claimed = line.sigma("a", "b", t);
    CHECK(claimed >= independent(shares) - 1e-9);
    for (int i = 0; i < 20; ++i) CHECK(claimed >= related(shares, random) - 1e-9);
  }
}

TEST_CASE("A segment of many samples has no more common errors than a message") {
  constexpr int kEdges = 140;
  Forest forest{[] { return at(0); }};
  REQUIRE(forest.add("f0", "", {}));
  for (int i = 1; i <= kEdges; ++i) {
    const std::string id = "f" + std::to_string(i);
    REQUIRE(forest.add(id, "f" + std::to_string(i - 1), Transform::exact({})));
    REQUIRE(forest.correlate(id, supply()));
    for (const double step : {0.0, 2.0}) {
      REQUIRE(forest.update(id, Transform::exact({}), at(step + 0.001 * i)));
    }
    REQUIRE(forest.update(id, Transform::exact({}), at(4)));
  }
  Query query;
  query.at = at(1);
  // At the newest instant all have a sample; between, as many errors as edges.
  const std::vector<PathEnds> asked = {{"f0", "f" + std::to_string(kEdges)}};
  for (const bool hinted : {false, true}) {
    INFO((hinted ? "hint" : "asked"));
    const auto found =
        forest.lookup_segments(asked, hinted ? Query{} : query, hinted ? query.at : std::nullopt);
    REQUIRE(found);
    const ValuesAtInstant& there = hinted ? found->at_hint : *found;
    REQUIRE(there.correlations.size() == 1);
    CHECK(there.correlations[0].common_errors.size() <= kMaxCommonErrors);
    // All errors may be one.
    const Transform X = collapse(belief_of(there.values[0], there.correlations[0]));
    const double sigma = std::sqrt(X.covariance.if_complete()->upper()[0]);
    CHECK(sigma == Approx(kEdges * kSize));
  }
}

// world -> a -> b, whose errors of the source are opposed.
class Chain {
 public:
  Chain() { REQUIRE(forest.add("world", "", {})); }

  void add(const std::string& id, const std::string& parent, double sign,
           const std::vector<double>& steps) {
    REQUIRE(forest.add(id, parent, Transform::exact({})));
    Correlation said = supply();
    said.common_errors[0].loading *= sign;
    REQUIRE(forest.correlate(id, said));
    for (const double step : steps) REQUIRE(forest.update(id, Transform::exact({}), at(step)));
  }
  [[nodiscard]] std::vector<EdgeFromFixed> edges(double step) const {
    Query query;
    query.at = at(step);
    const auto found = edges_from_fixed(forest, "world", "b", query);
    REQUIRE(found);
    return *found;
  }
  // The pose of b at the first step, there at the second one.
  [[nodiscard]] StampedTransform since(double first, double second) const {
    const StampedTransform X_FA{Transform::exact({}), at(first)};
    const StampedTransform X_FB{Transform::exact({}), at(second)};
    return over_fixed(X_FA, X_FB, edges(first), edges(second), Order::kSecond);
  }
  // Over one second.
  [[nodiscard]] MeanVelocity velocity(double first, double second) const {
    const auto before = edges(first);
    const auto after = edges(second);
    std::vector<EdgeAtEnds> ends;
    for (std::size_t i = 0; i < before.size(); ++i) {
      ends.push_back({before[i].X_PC, after[i].X_PC, ObservedEdge::Way::kDown, !before[i].moving,
                      before[i].drifts});
    }
    return mean_velocity(ends, 1);
  }

  Forest forest{[] { return at(0); }};
};

double sigma_of(const StampedTransform& X) {
  return std::sqrt(X.covariance.if_complete()->upper()[0]);
}

// One interval beyond, the errors S0, S1 of the source count 2 S1 - S0 of a sample as given, and
// S1 - S0 of one whose own error an observation has removed.
TEST_CASE("A source adds up beyond a sample that was corrected") {
  Chain chain;
  for (const char* id : {"a", "b"}) chain.add(id, *id == 'a' ? "world" : "a", 1, {0, 1});
  const auto seen = chain.forest.lookup_segments({{"world", "a"}}, {}, {}, true);
  REQUIRE(seen);
  const ObservedEdge edge{belief_of(seen->values[0], seen->correlations[0]),
                          ObservedEdge::Way::kDown};
  const Covariance sensor = *Covariance::from_stddev({1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6});
  const auto found = observe({edge}, {Pose(), sensor}, "observed:1", {1.0, true});
  REQUIRE(found);
  const Belief& X = found->edges[0].X_PC;
  REQUIRE(chain.forest.revise({{"a", {X.pose, X.own}, {false, X.common_errors, {}}}}, at(1),
                              seen->commit));
  Query query;
  query.at = at(2);
  query.extrapolate = std::chrono::seconds(1);
  const auto ahead = chain.forest.lookup("world", "b", query);
  REQUIRE(ahead);
  CHECK(ahead->basis.bound);
  // 3 S1 - 2 S0 at the worst.
  CHECK(sigma_of(*ahead) > 0.999 * 5 * kSize);
  CHECK(sigma_of(*ahead) < 1.01 * 5 * kSize);
}

TEST_CASE("A source of different samples does not cancel at an end of two instants") {
  Chain chain;
  chain.add("a", "world", 1, {0, 2, 4, 6});
  chain.add("b", "a", -1, {1, 3, 5});
  const StampedTransform X = chain.since(2, 4);
  CHECK(sigma_of(X) == Approx(4 * kSize));
  CHECK(X.basis.bound);
  CHECK(X.basis.sources == std::vector<std::string>{"supply"});
  const MeanVelocity velocity = chain.velocity(2, 4);
  CHECK(std::sqrt(velocity.covariance.upper()[0]) == Approx(4 * kSize));
  CHECK(velocity.bound);
  CHECK(velocity.sources == std::vector<std::string>{"supply"});
}

TEST_CASE("A source of the same samples cancels at each of two instants") {
  Chain chain;
  chain.add("a", "world", 1, {0, 1, 2, 3});
  chain.add("b", "a", -1, {0, 1, 2, 3});
  for (const double step : {0.5, 1.25, 2.0}) {
    INFO("step " << step);
    CHECK(sigma_of(chain.since(step, 2.5)) == Approx(0).margin(1e-9));
    CHECK_FALSE(chain.since(step, 2.5).basis.bound);
    CHECK(chain.velocity(step, 2.5).covariance.upper()[0] == Approx(0).margin(1e-12));
  }
}

TEST_CASE("A source that a static edge makes last is one error at two instants") {
  Chain chain;
  chain.add("a", "world", 1, {0, 2, 4});
  chain.add("b", "a", -1, {});
  CHECK(sigma_of(chain.since(1, 3)) == Approx(0).margin(1e-9));
  CHECK(chain.velocity(1, 3).covariance.upper()[0] == Approx(0).margin(1e-12));
}

TEST_CASE("No relation of a source's errors exceeds what is claimed at two instants") {
  Random random(7152);
  INFO("seed " << random.seed());
  for (int run = 0; run < 100; ++run) {
    Chain chain;
    std::vector<std::vector<double>> all;
    for (const bool first : {true, false}) {
      std::vector<double>& steps = all.emplace_back();
      for (int step = 0; step <= 6; ++step) {
        if (step == 0 || step == 6 || random.uniform(0, 1) < 0.5) steps.push_back(step);
      }
      chain.add(first ? "a" : "b", first ? "world" : "a", first ? 1 : -1, steps);
    }
    const double begin = 0.5 * static_cast<double>(random.index(13));
    const double end = 0.5 * static_cast<double>(random.index(13));
    Shares shares;
    for (const double sign : {1.0, -1.0}) {
      const auto& steps = all[sign > 0 ? 0 : 1];
      add_shares(shares, steps, begin, -sign);
      add_shares(shares, steps, end, sign);
    }
    const double claimed = sigma_of(chain.since(begin, end));
    const double of_velocity = std::sqrt(chain.velocity(begin, end).covariance.upper()[0]);
    INFO("run " << run << " from " << begin << " to " << end);
    CHECK(claimed >= independent(shares) - 1e-9);
    if (begin != end) CHECK(of_velocity == Approx(claimed).margin(1e-9));
    for (int i = 0; i < 20; ++i) CHECK(claimed >= related(shares, random) - 1e-9);
  }
}

}  // namespace
}  // namespace tfdude
