// The uncertainty of a pose between two instants, beside the joint covariance of the errors of all
// edges at both. What is not known of it is taken for the worst, direction by direction.

#include "tree/over_fixed.hpp"

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "tfdude/math/perturbation.hpp"

#include "support/catch.hpp"
#include "support/jacobian.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::Approx;
using testing::Random;

enum class Kind { kStatic, kDynamic, kDrifts };

struct Ways {
  std::vector<EdgeFromFixed> to_a;
  std::vector<EdgeFromFixed> to_b;
  bool same_instant = false;
  bool a_is_later = false;
};

Pose end_of(const std::vector<EdgeFromFixed>& way) {
  Pose X;
  for (const EdgeFromFixed& edge : way) {
    X = X * (edge.up ? edge.X_PC.pose.inverse() : edge.X_PC.pose);
  }
  return X;
}

StampedTransform answer(const Ways& ways) {
  const Time now{std::chrono::seconds(100)};
  const Milliseconds off(ways.same_instant ? 0 : ways.a_is_later ? -70 : 70);
  StampedTransform X_FA{{end_of(ways.to_a), Covariance()}, now};
  StampedTransform X_FB{{end_of(ways.to_b), Covariance()}, now + off};
  std::vector<std::string> unspecified;
  for (const EdgeFromFixed& edge : ways.to_a) {
    if (edge.X_PC.unspecified) X_FA.basis.unspecified.push_back(edge.id);
  }
  for (const EdgeFromFixed& edge : ways.to_b) {
    if (edge.X_PC.unspecified) X_FB.basis.unspecified.push_back(edge.id);
  }
  for (StampedTransform* one : {&X_FA, &X_FB}) {
    one->covariance.set_complete(one->basis.unspecified.empty());
  }
  return over_fixed(X_FA, X_FB, ways.to_a, ways.to_b, Order::kSecond);
}

// What the error of one edge at one of the instants makes of the error of X_AB, by differences.
Matrix6d effect(const Ways& ways, bool on_way_to_a, std::size_t i) {
  constexpr double kStep = 1e-6;
  const Pose X_AB = end_of(ways.to_a).inverse() * end_of(ways.to_b);
  Matrix6d J;
  for (Eigen::Index k = 0; k < 6; ++k) {
    Twist difference = Twist::Zero();
    for (const double sign : {1.0, -1.0}) {
      Ways moved = ways;
      Pose& X_PC = (on_way_to_a ? moved.to_a : moved.to_b)[i].X_PC.pose;
      X_PC = X_PC * exp(sign * kStep * Twist::Unit(k));
      difference += sign * log(X_AB.inverse() * end_of(moved.to_a).inverse() * end_of(moved.to_b));
    }
    J.col(k) = difference / (2 * kStep);
  }
  return J;
}

// An edge's errors at both instants, and their effects; zero where it is on one way only.
struct Pair {
  Matrix6d J_a = Matrix6d::Zero();
  Matrix6d J_b = Matrix6d::Zero();
  const EdgeFromFixed* at_a = nullptr;
  const EdgeFromFixed* at_b = nullptr;
};

std::map<std::string, Pair> pairs_of(const Ways& ways) {
  std::map<std::string, Pair> pairs;
  for (std::size_t i = 0; i < ways.to_a.size(); ++i) {
    Pair& pair = pairs[ways.to_a[i].id];
    pair.at_a = &ways.to_a[i];
    pair.J_a = effect(ways, true, i);
  }
  for (std::size_t i = 0; i < ways.to_b.size(); ++i) {
    Pair& pair = pairs[ways.to_b[i].id];
    pair.at_b = &ways.to_b[i];
    pair.J_b = effect(ways, false, i);
  }
  return pairs;
}

double deviation(const Matrix6d& J, const Matrix6d& sigma, const Twist& v) {
  const Twist at_edge = J.transpose() * v;
  return std::sqrt(std::max(0.0, at_edge.dot(sigma * at_edge)));
}

// The largest variance of vᵀ ξ that the edge's share may have, whatever is not known; and the one
// if errors at two instants are independent.
struct Share {
  double worst = 0;
  double independent = 0;
};
Share share_of(const Pair& pair, const Ways& ways, const Twist& v) {
  if (pair.at_a == nullptr || pair.at_b == nullptr) {
    const bool a = pair.at_a != nullptr;
    const double one =
        deviation(a ? pair.J_a : pair.J_b, (a ? pair.at_a : pair.at_b)->X_PC.own.matrix(), v);
    return {one * one, one * one};
  }
  const Matrix6d at_a = pair.at_a->X_PC.own.matrix();
  const Matrix6d at_b = pair.at_b->X_PC.own.matrix();
  if (ways.same_instant || !pair.at_a->moving) {
    const double both = deviation(pair.J_a + pair.J_b, at_a, v);
    return {both * both, both * both};
  }
  if (pair.at_a->drifts) {
    // e1 = F e0 + w
    const Pair in_time = ways.a_is_later ? Pair{pair.J_b, pair.J_a, pair.at_b, pair.at_a} : pair;
    const Pose step = in_time.at_a->X_PC.pose.inverse() * in_time.at_b->X_PC.pose;
    const Matrix6d F = adjoint(step.inverse());
    const Matrix6d before = in_time.at_a->X_PC.own.matrix();
    const Matrix6d added = in_time.at_b->X_PC.own.matrix() - F * before * F.transpose();
    const double first = deviation(in_time.J_a + in_time.J_b * F, before, v);
    const double then = deviation(in_time.J_b, added, v);
    return {first * first + then * then, first * first + then * then};
  }
  const double a = deviation(pair.J_a, at_a, v);
  const double b = deviation(pair.J_b, at_b, v);
  return {(a + b) * (a + b), a * a + b * b};
}

EdgeFromFixed edge_of(const std::string& id, const Pose& X, const Covariance& own, Kind kind,
                      bool up) {
  EdgeFromFixed edge;
  edge.id = id;
  edge.X_PC.pose = X;
  edge.X_PC.own = own;
  edge.up = up;
  edge.moving = kind != Kind::kStatic;
  edge.drifts = kind == Kind::kDrifts;
  return edge;
}

// An edge on both ways, at both instants.
void add_shared(Ways& ways, const std::string& id, Kind kind, Random& random) {
  const bool up = random.index(3) == 0;
  const EdgeFromFixed first = edge_of(id, random.pose(), random.covariance(0.02, 0.01), kind, up);
  EdgeFromFixed then = first;
  if (kind != Kind::kStatic && !ways.same_instant) {
    const Pose step = exp(random.twist(0.5, 0.5));
    then.X_PC.pose = first.X_PC.pose * step;
    then.X_PC.own = random.covariance(0.02, 0.01);
    if (kind == Kind::kDrifts) {
      then.X_PC.own = first.X_PC.own.transported(step.inverse()) + random.covariance(0.01, 0.01);
    }
  }
  ways.to_a.push_back(ways.a_is_later ? then : first);
  ways.to_b.push_back(ways.a_is_later ? first : then);
}

Ways random_ways(Random& random) {
  Ways ways;
  ways.same_instant = random.index(8) == 0;
  ways.a_is_later = !ways.same_instant && random.index(2) == 0;
  const std::size_t shared = 1 + random.index(4);
  for (std::size_t i = 0; i < shared; ++i) {
    add_shared(ways, "shared" + std::to_string(i), static_cast<Kind>(random.index(3)), random);
  }
  for (auto* way : {&ways.to_a, &ways.to_b}) {
    const std::size_t more = random.index(3);
    for (std::size_t i = 0; i < more; ++i) {
      way->push_back(edge_of((way == &ways.to_a ? "a" : "b") + std::to_string(i), random.pose(),
                             random.covariance(0.02, 0.01), static_cast<Kind>(random.index(3)),
                             random.index(3) == 0));
    }
  }
  return ways;
}

Twist random_direction(Random& random) {
  Twist v;
  for (double& one : v) one = random.normal();
  return v.normalized();
}

// Of all edges but those that are unspecified.
Share share_of(const Ways& ways, const std::map<std::string, Pair>& pairs, const Twist& v) {
  Share sum;
  for (const auto& [id, pair] : pairs) {
    const Share one = share_of(pair, ways, v);
    sum.worst += one.worst;
    sum.independent += one.independent;
  }
  return sum;
}

void check_against_joint(const Ways& ways, Random& random) {
  const StampedTransform X_AB = answer(ways);
  const Matrix6d sigma = X_AB.covariance.of_specified().matrix();
  const auto pairs = pairs_of(ways);
  for (int k = 0; k < 50; ++k) {
    const Twist v = k < 6 ? Twist(Twist::Unit(k)) : random_direction(random);
    const Share share = share_of(ways, pairs, v);
    const double got = v.dot(sigma * v);
    CHECK(got > share.worst - 1e-7 * share.independent - 1e-12);
    if (!X_AB.basis.bound) CHECK(got < share.worst * (1 + 1e-6) + 1e-12);
  }
}

}  // namespace

TEST_CASE("over fixed: no correlation of the dynamic edges exceeds it, and all others are exact") {
  Random random(4711);
  INFO("seed " << random.seed());
  for (int round = 0; round < 300; ++round) {
    INFO("round " << round);
    check_against_joint(random_ways(random), random);
  }
}

TEST_CASE("over fixed: two values of a static edge may have errors of any relation") {
  Random random(4713);
  INFO("seed " << random.seed());
  for (int round = 0; round < 100; ++round) {
    INFO("round " << round);
    Ways ways = random_ways(random);
    // As of two states, between which it was told anew; or only its error.
    EdgeFromFixed first = edge_of("base", random.pose(), random.covariance(0.02, 0.01),
                                  Kind::kStatic, random.index(2) == 0);
    EdgeFromFixed then = first;
    if (random.index(3) > 0) then.X_PC.pose = first.X_PC.pose * exp(random.twist(0.5, 0.5));
    then.X_PC.own = random.covariance(0.02, 0.01);
    ways.to_a.insert(ways.to_a.begin(), first);
    ways.to_b.insert(ways.to_b.begin(), then);
    const StampedTransform X_AB = answer(ways);
    const Matrix6d sigma = X_AB.covariance.of_specified().matrix();
    CHECK(X_AB.basis.bound);
    auto pairs = pairs_of(ways);
    const Pair base = pairs.at("base");
    pairs.erase("base");
    for (int k = 0; k < 50; ++k) {
      const Twist v = k < 6 ? Twist(Twist::Unit(k)) : random_direction(random);
      const Share others = share_of(ways, pairs, v);
      const double both = deviation(base.J_a, first.X_PC.own.matrix(), v) +
                          deviation(base.J_b, then.X_PC.own.matrix(), v);
      const double worst = others.worst + both * both;
      CHECK(v.dot(sigma * v) > worst * (1 - 1e-6) - 1e-12);
    }
  }
}

TEST_CASE("over fixed: unspecified edges leave the covariance of all others") {
  Random random(4712);
  INFO("seed " << random.seed());
  for (int round = 0; round < 300; ++round) {
    INFO("round " << round);
    Ways ways = random_ways(random);
    const std::string id = ways.to_a[random.index(ways.to_a.size())].id;
    bool cancels = false;
    for (auto* way : {&ways.to_a, &ways.to_b}) {
      for (EdgeFromFixed& edge : *way) {
        if (edge.id != id) continue;
        edge.X_PC.own = {};
        edge.X_PC.unspecified = true;
      }
    }
    // An edge before all that may have moved has no effect.
    for (std::size_t i = 0; i < std::min(ways.to_a.size(), ways.to_b.size()); ++i) {
      if (ways.to_a[i].id != ways.to_b[i].id) break;
      if (ways.to_a[i].moving && !ways.same_instant) break;
      cancels = cancels || ways.to_a[i].id == id;
    }
    check_against_joint(ways, random);
    const StampedTransform X_AB = answer(ways);
    CHECK(X_AB.basis.unspecified ==
          (cancels ? std::vector<std::string>{} : std::vector<std::string>{id}));
    CHECK(X_AB.covariance.complete() == cancels);
  }
}

TEST_CASE("over fixed: edges that err independently are bounded one by one") {
  for (const int edges : {1, 2, 4, 8}) {
    Ways ways;
    for (int i = 0; i < edges; ++i) {
      const Covariance own = *Covariance::from_stddev({0.01, 0.01, 0.01, 0, 0, 0});
      for (auto* way : {&ways.to_a, &ways.to_b}) {
        way->push_back(edge_of("e" + std::to_string(i), Pose(), own, Kind::kDynamic, false));
      }
    }
    const StampedTransform X_AB = answer(ways);
    CHECK(X_AB.basis.bound);
    CHECK(X_AB.covariance.of_specified().matrix()(0, 0) == Approx(edges * 0.02 * 0.02));
  }
}

TEST_CASE("over fixed: a source of a dynamic edge may have another error at the other instant") {
  Random random(4713);
  INFO("seed " << random.seed());
  for (int round = 0; round < 100; ++round) {
    INFO("round " << round);
    Ways ways;
    add_shared(ways, "still", Kind::kStatic, random);
    add_shared(ways, "moves", Kind::kDynamic, random);
    add_shared(ways, "mount", Kind::kStatic, random);
    for (auto* way : {&ways.to_a, &ways.to_b}) {
      for (EdgeFromFixed& edge : *way) edge.X_PC.own = {};
    }
    const Loading of_move = 0.01 * Loading::Random(6, 2);
    const Loading of_mount = 0.01 * Loading::Random(6, 2);
    for (auto* way : {&ways.to_a, &ways.to_b}) {
      (*way)[1].X_PC.common_errors = {{"supply", false, of_move}};
      (*way)[2].X_PC.common_errors = {{"supply", false, of_mount}};
    }
    const StampedTransform X_AB = answer(ways);
    CHECK(X_AB.basis.bound);
    CHECK(X_AB.basis.sources == std::vector<std::string>{"supply"});
    const auto sum = [&](bool a) -> Loading {
      return effect(ways, a, 1) * of_move + effect(ways, a, 2) * of_mount;
    };
    const Loading L_a = sum(true);
    const Loading L_b = sum(false);
    for (int k = 0; k < 30; ++k) {
      const Twist v = random_direction(random);
      const double worst = std::pow((L_a.transpose() * v).norm() + (L_b.transpose() * v).norm(), 2);
      CHECK(v.dot(X_AB.covariance.of_specified().matrix() * v) > worst * (1 - 1e-6));
    }
  }
}

TEST_CASE("over fixed: a static edge of unknown correlation has one error, too") {
  Random random(4714);
  INFO("seed " << random.seed());
  for (int round = 0; round < 100; ++round) {
    INFO("round " << round);
    Ways ways;
    add_shared(ways, "moves", Kind::kDrifts, random);
    add_shared(ways, "mount", Kind::kStatic, random);
    const Covariance unknown = ways.to_a[1].X_PC.own;
    for (auto* way : {&ways.to_a, &ways.to_b}) {
      (*way)[0].X_PC.own = {};
      (*way)[1].X_PC.own = {};
      (*way)[1].X_PC.unknown = unknown;
    }
    const StampedTransform X_AB = answer(ways);
    CHECK(X_AB.basis.bound);
    const Matrix6d J = effect(ways, true, 1) + effect(ways, false, 1);
    const Matrix6d expected = J * unknown.matrix() * J.transpose();
    const Matrix6d got = X_AB.covariance.of_specified().matrix();
    CHECK((got - expected).norm() < 1e-6 * expected.norm());
  }
}

TEST_CASE(
    "over fixed: what an observation has tied to a dynamic edge may be tied at both instants") {
  Random random(4715);
  INFO("seed " << random.seed());
  for (int round = 0; round < 200; ++round) {
    INFO("round " << round);
    Ways ways;
    add_shared(ways, "moves", Kind::kDynamic, random);
    add_shared(ways, "mount", Kind::kStatic, random);
    // The pose of the mount at the instant of a was measured: K is the gain, e -> e - K (H e + n).
    const Matrix6d before[] = {ways.to_a[0].X_PC.own.matrix(), ways.to_a[1].X_PC.own.matrix()};
    const Matrix6d H[] = {effect(ways, true, 0), effect(ways, true, 1)};
    const Matrix6d noise = random.covariance(0.002, 0.002).matrix();
    Matrix6d S = noise;
    for (const int i : {0, 1}) S += H[i] * before[i] * H[i].transpose();
    const Matrix6d root = testing::cholesky_root(testing::inverse_of(S));
    for (const int i : {0, 1}) {
      const Loading loading = before[i] * H[i].transpose() * root;
      ways.to_a[static_cast<std::size_t>(i)].X_PC.common_errors = {{"observed:1", true, loading}};
      if (i == 1) ways.to_b[1].X_PC.common_errors = {{"observed:1", true, loading}};
    }
    const StampedTransform X_AB = answer(ways);
    CHECK(X_AB.basis.bound);
    const Matrix6d sigma = X_AB.covariance.of_specified().matrix();
    // The errors before it, of the edges and of the measurement, to that of X_AB.
    const Matrix6d J[] = {effect(ways, true, 0), effect(ways, true, 1) + effect(ways, false, 1)};
    const Matrix6d gain =
        (J[0] * before[0] * H[0].transpose() + J[1] * before[1] * H[1].transpose()) * S.inverse();
    for (int k = 0; k < 30; ++k) {
      const Twist v = random_direction(random);
      const double moved = deviation(J[0] - gain * H[0], before[0], v) +
                           deviation(effect(ways, false, 0), ways.to_b[0].X_PC.own.matrix(), v);
      const double rest = deviation(J[1] - gain * H[1], before[1], v);
      const double measured = deviation(gain, noise, v);
      const double worst = moved * moved + rest * rest + measured * measured;
      CHECK(v.dot(sigma * v) > worst * (1 - 1e-6));
    }
  }
}

// e0 = s and m = -s; X_AB is off by e1 + m - e0 - m, and e1 may be -s.
TEST_CASE("over fixed: what an observation has left may all add") {
  const auto along = [](double size) {
    Loading F = Loading::Zero(6, 1);
    F(0, 0) = size;
    return std::vector<CommonError>{{"observed:1", false, F}};
  };
  EdgeFromFixed seen{"moves", {}, false, true, false, false};
  seen.X_PC.common_errors = along(1);
  EdgeFromFixed later = seen;
  later.X_PC.common_errors.clear();
  later.X_PC.own = *Covariance::from_stddev({1, 0, 0, 0, 0, 0});
  EdgeFromFixed mount{"mount", {}, false, false, false, false};
  mount.X_PC.common_errors = along(-1);
  // Another observation, of the other instant.
  EdgeFromFixed again = seen;
  again.X_PC.common_errors[0].source = "observed:2";
  for (const EdgeFromFixed& other : {later, again}) {
    for (const bool first : {true, false}) {
      const StampedTransform X_AB =
          answer({{first ? seen : other, mount}, {first ? other : seen, mount}});
      CHECK(X_AB.basis.bound);
      CHECK(X_AB.covariance.of_specified().upper()[0] > 4 - 1e-9);
    }
  }
}

}  // namespace tfdude
