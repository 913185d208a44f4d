// Random trees of several owners, whose edges get new values, samples and positions of joints,
// drift, are observed now and in the past, added, moved and removed. The covariance of every pair
// of frames is that of a dense joint filter, which knows nothing of columns, samples or owners, or
// larger, where observations come later than others of the same edges. So it is at the last
// instants at which an edge that drifts was observed, and between them. All measurements agree with
// the estimate, so that poses stay and one linearization holds.

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/math/joint.hpp"

#include "support/catch.hpp"
#include "support/networks.hpp"
#include "support/random.hpp"
#include "support/random_walk.hpp"
#include "support/sampling.hpp"
#include "support/sanitizers.hpp"
#include "tree/sample_rows.hpp"

namespace tfdude {
namespace {

using testing::Join;
using testing::Random;

using Matrix = Eigen::MatrixXd;

// How much of its variance an earlier sample must keep in any direction, at least.
constexpr double kKeptOfEarlier = 0.5;

// The joint covariance of all values, by name: that of the child of an edge, with the number of the
// sample if it is dynamic.
class DenseFilter {
 public:
  void forget(const std::string& id) { rows_.erase(id); }
  // A new value, independent of all others.
  void set(const std::string& id, const Covariance& sigma) {
    const auto [place, is_new] = rows_.try_emplace(id, P_.rows());
    if (is_new) {
      Matrix larger = Matrix::Zero(P_.rows() + 6, P_.rows() + 6);
      larger.topLeftCorner(P_.rows(), P_.rows()) = P_;
      P_ = larger;
    }
    P_.middleRows(place->second, 6).setZero();
    P_.middleCols(place->second, 6).setZero();
    P_.block(place->second, place->second, 6, 6) = sigma.matrix();
  }
  // A value whose error is that of another one, moved, and what has been added.
  void drift(const std::string& from, const std::string& to, const Pose& increment,
             const Matrix6d& added) {
    set(to, Covariance());
    const Eigen::Index before = rows_.at(from);
    const Eigen::Index row = rows_.at(to);
    const Matrix6d back = adjoint(increment.inverse());
    P_.middleRows(row, 6) = (back * P_.middleRows(before, 6)).eval();
    P_.middleCols(row, 6) = (P_.middleCols(before, 6) * back.transpose()).eval();
    P_.block(row, row, 6, 6) =
        (back * P_.block(before, before, 6, 6) * back.transpose() + added).eval();
  }
  void observe(const std::map<std::string, Matrix6d>& path, const Covariance& R) {
    const Matrix PH = with(path);
    const Matrix6d S = of(path) + R.matrix();
    P_ -= (PH * testing::inverse_of(S) * PH.transpose()).eval();
  }
  [[nodiscard]] Matrix6d of(const std::map<std::string, Matrix6d>& path) const {
    const Matrix PH = with(path);
    Matrix6d sum = Matrix6d::Zero();
    for (const auto& [id, block] : path) sum += block * PH.middleRows<6>(rows_.at(id));
    return sum;
  }

 private:
  // Of all values with the path.
  [[nodiscard]] Matrix with(const std::map<std::string, Matrix6d>& path) const {
    Matrix sum = Matrix::Zero(P_.rows(), 6);
    for (const auto& [id, block] : path) {
      sum += P_.middleCols<6>(rows_.at(id)).lazyProduct(block.transpose());
    }
    return sum;
  }

  std::map<std::string, Eigen::Index> rows_;
  Matrix P_{0, 0};
};

// In units of the deviation along each axis.
bool is_close(const Matrix6d& found, const Matrix6d& expected) {
  const Twist scale = expected.diagonal().cwiseMax(1e-12).cwiseSqrt().cwiseInverse();
  const Matrix6d difference = scale.asDiagonal() * (found - expected) * scale.asDiagonal();
  return difference.cwiseAbs().maxCoeff() < 1e-5;
}

// The least of their ratio in any direction.
double least_ratio(const Matrix6d& found, const Matrix6d& expected) {
  return testing::ratios(found, expected)[0];
}

// When observations come.
enum class Sightings {
  kInOrder,  // of the newest sample, or of the one before if no other has been of a later one
  kLate,     // of any of the newest samples, in any order
};

class Robot {
 public:
  Robot(const Join& join, Random& random, Sightings sightings)
      : random_(random), sightings_(sightings), slider_(slider(random)) {
    EdgeTiming drifting;
    drifting.drifts = true;
    drifting.process_noise = Q_;
    FrameSpec base{"base", "world", {}};
    base.timing = drifting;
    FrameSpec tool{"tool", "base", {}};
    tool.joint = slider_;
    const std::size_t owners = 1 + random.index(3);
    for (std::size_t i = 0; i < owners; ++i) {
      std::vector<FrameSpec> frames{{"root" + std::to_string(i), "", {}}};
      if (i == 0) frames = {{"world", "", {}}, base};
      if (i + 1 == owners) frames.push_back(tool);
      if (i + 1 == owners) frames.push_back({"head", "base", {}});
      names_.push_back("p" + std::to_string(i));
      nodes_.push_back(Node::open(join(names_.back()), names_.back(), frames).value());
    }
    client_.emplace(Client::open(join("")).value());
    parents_ = {{"world", ""}, {"base", "world"}, {"head", "base"}, {"tool", "base"}};
    drive();
    drive();
    for (std::size_t i = 0; i < 2 + random.index(5); ++i) add();
  }

  void step() {
    switch (random_.index(9)) {
      case 0:
        return set(any());
      case 1:
      case 2:
        return drive();
      case 3:
        return parents_.size() < 12 ? add() : remove();
      case 4:
        return move(any(), any());
      case 5:
        return observe(any(), any(), earlier());
      default:
        return observe(any(), any(), newest_);
    }
  }

  void compare() {
    poses_.clear();
    for (const auto& [a, of_a] : parents_) {
      for (const auto& [b, of_b] : parents_) {
        if (a >= b) continue;
        compare(a, b, newest_, sightings_ == Sightings::kInOrder);
        for (int sample = newest_ - 1; sample >= std::max(0, newest_ - 3); --sample) {
          if (is_kept(a, b, sample)) {
            compare(a, b, sample, true);
          } else {
            // Later observations do not correct it again, nor what ties it to others.
            compare_earlier(a, b, sample);
          }
        }
      }
    }
  }

 private:
  static JointSpec slider(Random& random) {
    JointSpec spec;
    spec.name = "slider";
    spec.type = JointType::kPrismatic;
    spec.joint = prismatic_joint(random.transform(1.0, 0.01, 0.01), random.direction());
    return spec;
  }

  [[nodiscard]] std::string any() {
    auto frame = parents_.begin();
    std::advance(frame, random_.index(parents_.size()));
    return frame->first;
  }
  [[nodiscard]] Transform edge() { return random_.transform(1.0, 0.01, 0.01); }
  [[nodiscard]] static bool is_static(const std::string& id) { return id.front() == 'f'; }
  // Of the edge's value at a sample, in the filter.
  [[nodiscard]] static std::string row(const std::string& id, int sample) {
    return is_static(id) ? id : id + "#" + std::to_string(sample);
  }
  [[nodiscard]] static Time stamp(int sample) {
    return Time(std::chrono::milliseconds(1'000'000 + 100 * sample));
  }
  [[nodiscard]] Result<StampedTransform> look_up(const std::string& a, const std::string& b,
                                                 int sample) {
    Query query;
    query.at = stamp(sample);
    return client_->lookup(a, b, query);
  }

  // An earlier sample, if the order of observations lets it be chosen.
  [[nodiscard]] int earlier() {
    if (sightings_ == Sightings::kInOrder) return ahead_ ? newest_ : newest_ - 1;
    return std::max(0, newest_ - 1 - static_cast<int>(random_.index(4)));
  }

  // Whether the pair has what the filter has at an earlier sample: if of its edges only the base
  // moves, which drifts and was observed then, or before and after.
  [[nodiscard]] bool is_kept(const std::string& a, const std::string& b, int sample) const {
    if (sightings_ != Sightings::kInOrder) return false;
    const std::size_t kept = std::min(seen_.size(), kFewestRows + 1);
    if (kept == 0 || sample < *std::prev(seen_.end(), static_cast<std::ptrdiff_t>(kept)))
      return false;
    const auto moves = [&](std::string frame) {
      for (; !frame.empty(); frame = parents_.at(frame)) {
        if (frame == "head" || frame == "tool") return true;
      }
      return false;
    };
    return !moves(a) && !moves(b);
  }

  // Whether it is what the filter has, or, unless that is `exact`, nowhere more certain.
  void compare(const std::string& a, const std::string& b, int sample, bool exact) {
    compare(a, b, sample, [exact](const Matrix6d& found, const Matrix6d& expected) {
      return exact ? is_close(found, expected) : least_ratio(found, expected) > 1 - 1e-5;
    });
  }
  void compare_earlier(const std::string& a, const std::string& b, int sample) {
    compare(a, b, sample, [](const Matrix6d& found, const Matrix6d& expected) {
      return least_ratio(found, expected) > kKeptOfEarlier;
    });
  }
  template <class IsRight>
  void compare(const std::string& a, const std::string& b, int sample, IsRight is_right) {
    const auto X_AB = look_up(a, b, sample);
    if (!X_AB) FAIL(X_AB.error().message << ", after" << told_);
    const Matrix6d expected = filter_.of(path(a, b, sample));
    const Matrix6d found = X_AB->covariance.of_specified().matrix();
    if (is_right(found, expected)) return;
    FAIL("from " << a << " to " << b << " at sample " << sample << " of " << newest_ << " after"
                 << told_ << ": expected σ " << expected.diagonal().cwiseSqrt().transpose()
                 << ", found " << found.diagonal().cwiseSqrt().transpose() << ", least ratio "
                 << least_ratio(found, expected));
  }

  // The next samples of all dynamic edges.
  void drive() {
    const Pose increment = exp(random_.twist(0.1, 0.1));
    G_ = G_ * increment;
    const bool first = newest_ < 0;
    ++newest_;
    const Covariance sigma = edge().covariance.of_specified();
    const Transform X_BH = edge();
    const double position = random_.uniform(-1, 1);
    const double variance = random_.uniform(0.5, 2) * 1e-4;
    REQUIRE(client_->update({{"base", {G_, sigma}}, {"head", X_BH}}, stamp(newest_)));
    REQUIRE(client_->update_joints({"slider"}, {position}, {variance}, stamp(newest_)));
    if (first) {
      filter_.set(row("base", newest_), sigma);
    } else {
      filter_.drift(row("base", newest_ - 1), row("base", newest_), increment,
                    testing::walked_in_steps(Q_.matrix(), log(increment), 0.1));
    }
    filter_.set(row("head", newest_), X_BH.covariance.of_specified());
    const Transform X_BT = joint_transform(slider_.joint, position, variance);
    filter_.set(row("tool", newest_), X_BT.covariance.of_specified());
    ahead_ = false;
    told_ += " drive";
  }
  void add() {
    const std::string id = "f" + std::to_string(++frames_);
    const std::string parent = any();
    const Transform X = edge();
    REQUIRE(client_->add(id, parent, X, names_[random_.index(names_.size())]));
    parents_[id] = parent;
    filter_.set(id, X.covariance.of_specified());
    told_ += " add " + id + " to " + parent;
  }
  void remove() {
    const std::string id = any();
    for (const auto& [child, parent] : parents_) {
      if (parent == id) return;
    }
    if (!is_static(id)) return;
    REQUIRE(client_->remove(id));
    parents_.erase(id);
    filter_.forget(id);
    told_ += " remove " + id;
  }
  void set(const std::string& id) {
    if (!is_static(id)) return;
    const Transform X = edge();
    REQUIRE(client_->update(id, X));
    filter_.set(id, X.covariance.of_specified());
    told_ += " set " + id;
  }
  void move(const std::string& id, const std::string& parent) {
    if (!is_static(id)) return;
    for (std::string above = parent; !above.empty(); above = parents_.at(above)) {
      if (above == id) return;
    }
    const Transform X = edge();
    REQUIRE(client_->move(id, parent, X));
    parents_[id] = parent;
    filter_.set(id, X.covariance.of_specified());
    told_ += " move " + id + " to " + parent;
  }
  void observe(const std::string& a, const std::string& b, int sample) {
    if (a == b) return;
    const auto X_AB = look_up(a, b, sample);
    REQUIRE(X_AB);
    const double size = random_.index(2) == 0 ? 0.001 : 0.02;
    const Covariance R = random_.covariance(size, size);
    told_ += " observe " + a + " " + b + " at " + std::to_string(sample);
    INFO(told_);
    const auto observed = client_->observe(a, b, {X_AB->pose, R}, stamp(sample));
    if (!observed) FAIL(observed.error().message);
    poses_.clear();
    const auto edges = path(a, b, sample);
    if (edges.count(row("base", sample)) > 0) seen_.insert(sample);
    filter_.observe(edges, R);
    if (sightings_ == Sightings::kInOrder || sample == newest_) {
      compare(a, b, sample, sightings_ == Sightings::kInOrder);
    }
    ahead_ = true;
  }

  // Of a frame in the world.
  [[nodiscard]] const Pose& pose(const std::string& frame, int sample) {
    const auto [known, is_new] = poses_.try_emplace({frame, sample});
    if (is_new) known->second = look_up("world", frame, sample).value().pose;
    return known->second;
  }

  // The derivative of the error of X_AB by those of the edges.
  [[nodiscard]] std::map<std::string, Matrix6d> path(const std::string& a, const std::string& b,
                                                     int sample) {
    const auto above = [&](std::string frame) {
      std::vector<std::string> all;
      for (; !frame.empty(); frame = parents_.at(frame)) all.push_back(frame);
      return all;
    };
    std::map<std::string, Matrix6d> edges;
    const auto of_a = above(a);
    const auto of_b = above(b);
    const auto toggle = [&](const std::vector<std::string>& frames, double sign) {
      for (const std::string& frame : frames) {
        if (parents_.at(frame).empty() || edges.erase(row(frame, sample)) > 0) continue;
        const Pose X_BC = pose(b, sample).inverse() * pose(frame, sample);
        edges[row(frame, sample)] = sign * adjoint(X_BC);
      }
    };
    toggle(of_a, -1);
    toggle(of_b, 1);
    return edges;
  }

  Random& random_;
  const Sightings sightings_;
  const JointSpec slider_;
  const Covariance Q_ = *Covariance::from_stddev({0.02, 0.02, 0.02, 0.01, 0.01, 0.01});
  std::vector<std::string> names_;
  std::vector<Node> nodes_;
  std::optional<Client> client_;
  std::map<std::string, std::string> parents_;
  DenseFilter filter_;
  std::map<std::pair<std::string, int>, Pose> poses_;  // that are known since the last change
  Pose G_;
  int newest_ = -1;     // sample
  std::set<int> seen_;  // samples of the base
  bool ahead_ = false;  // an observation has corrected the newest sample of the base, but no other
  std::size_t frames_ = 0;
  std::string told_;
};

void run(const Join& join, Random& random, Sightings sightings, std::size_t steps) {
  Robot robot(join, random, sightings);
  for (std::size_t i = 0; i < steps; ++i) {
    robot.step();
    if (i % 4 == 3) robot.compare();
  }
}

}  // namespace

TEST_CASE("belief: every pair of frames agrees with a dense joint filter") {
  Random random(20261126);
  INFO("seed " << random.seed());
  for (int i = 0; i < 150; ++i) {
    INFO("run " << i);
    run(testing::join_loopback(), random, Sightings::kInOrder, 16);
  }
}

TEST_CASE("belief: late sightings make no pair of frames more certain than a dense filter") {
  Random random(20261128);
  INFO("seed " << random.seed());
  for (int i = 0; i < 150; ++i) {
    INFO("run " << i);
    run(testing::join_loopback(), random, Sightings::kLate, 16);
  }
}

#ifndef TFDUDE_THREAD_SANITIZER  // it does not see the locks of Fast DDS
TEST_CASE("belief: pairs agree with a dense joint filter over DDS") {
  Random random(20261127);
  INFO("seed " << random.seed());
  run(testing::join_fastdds(), random, Sightings::kInOrder, 24);
}
#endif

}  // namespace tfdude
