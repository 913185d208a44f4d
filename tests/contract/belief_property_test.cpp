// Random trees of several owners, whose edges get new values, drift, are observed, added and
// removed. The covariance of every pair of frames is that of a dense joint filter, which knows
// nothing of columns, samples or owners. All measurements agree with the estimate, so that poses
// stay and one linearization holds.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/LU>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/networks.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::Join;
using testing::Random;

using Matrix = Eigen::MatrixXd;

// The joint covariance of all edges, by the id of the child.
class DenseFilter {
 public:
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
  // The edge moves, and its error grows.
  void drift(const std::string& id, const Pose& increment, const Covariance& added) {
    const Eigen::Index row = rows_.at(id);
    const Matrix6d back = adjoint(increment.inverse());
    P_.middleRows(row, 6) = (back * P_.middleRows(row, 6)).eval();
    P_.middleCols(row, 6) = (P_.middleCols(row, 6) * back.transpose()).eval();
    P_.block(row, row, 6, 6) += added.matrix();
  }
  void observe(const std::map<std::string, Matrix6d>& path, const Covariance& R) {
    const Matrix H = derivative(path);
    const Matrix S = H * P_ * H.transpose() + R.matrix();
    const Matrix K = P_ * H.transpose() * S.inverse();
    const Matrix rest = Matrix::Identity(P_.rows(), P_.rows()) - K * H;
    P_ = (rest * P_ * rest.transpose() + K * R.matrix() * K.transpose()).eval();
  }
  [[nodiscard]] Matrix6d of(const std::map<std::string, Matrix6d>& path) const {
    const Matrix H = derivative(path);
    return H * P_ * H.transpose();
  }

 private:
  [[nodiscard]] Matrix derivative(const std::map<std::string, Matrix6d>& path) const {
    Matrix H = Matrix::Zero(6, P_.rows());
    for (const auto& [id, block] : path) H.middleCols(rows_.at(id), 6) = block;
    return H;
  }

  std::map<std::string, Eigen::Index> rows_;
  Matrix P_{0, 0};
};

class Robot {
 public:
  Robot(const Join& join, Random& random) : random_(random) {
    EdgeTiming drifting;
    drifting.drifts = true;
    drifting.process_noise = Q_;
    FrameSpec base{"base", "world", {}};
    base.timing = drifting;
    const std::size_t owners = 1 + random.index(3);
    for (std::size_t i = 0; i < owners; ++i) {
      std::vector<FrameSpec> frames{{"root" + std::to_string(i), "", {}}};
      if (i == 0) frames = {{"world", "", {}}, base};
      names_.push_back("p" + std::to_string(i));
      nodes_.push_back(Node::open(join(names_.back()), names_.back(), frames).value());
    }
    client_.emplace(Client::open(join("")).value());
    parents_["world"] = "";
    parents_["base"] = "world";
    drive();
    for (std::size_t i = 0; i < 2 + random.index(5); ++i) add();
  }

  void step() {
    switch (random_.index(6)) {
      case 0:
        return set(any());
      case 1:
        return drive();
      case 2:
        return parents_.size() < 12 ? add() : remove();
      default:
        return observe(any(), any());
    }
  }

  void compare() {
    for (const auto& [a, of_a] : parents_) {
      for (const auto& [b, of_b] : parents_) {
        if (a >= b) continue;
        const auto X_AB = client_->lookup(a, b);
        INFO("from " << a << " to " << b << " after " << told_);
        REQUIRE(X_AB);
        const Matrix6d expected = filter_.of(path(a, b));
        const Matrix6d found = X_AB->covariance.of_specified().matrix();
        const Twist deviations = expected.diagonal().cwiseMax(1e-12).cwiseSqrt();
        const Matrix6d difference = deviations.cwiseInverse().asDiagonal() * (found - expected) *
                                    deviations.cwiseInverse().asDiagonal();
        REQUIRE(difference.cwiseAbs().maxCoeff() < 1e-5);
      }
    }
  }

 private:
  [[nodiscard]] std::string any() {
    auto frame = parents_.begin();
    std::advance(frame, random_.index(parents_.size()));
    return frame->first;
  }
  [[nodiscard]] Transform edge() { return random_.transform(1.0, 0.01, 0.01); }

  void drive() {
    const Pose increment = exp(random_.twist(0.1, 0.1));
    const bool first = stamp_ == Time(std::chrono::seconds(1000));
    G_ = G_ * increment;
    stamp_ += std::chrono::milliseconds(100);
    const Covariance sigma = edge().covariance.of_specified();
    REQUIRE(client_->update("base", {G_, sigma}, stamp_));
    if (first) {
      filter_.set("base", sigma);
    } else {
      filter_.drift("base", increment, Covariance::trusted(Matrix6d(0.1 * Q_.matrix())));
    }
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
    if (id == "base" || id == "world") return;
    REQUIRE(client_->remove(id));
    parents_.erase(id);
    told_ += " remove " + id;
  }
  void set(const std::string& id) {
    if (id == "base" || id == "world") return;
    const Transform X = edge();
    REQUIRE(client_->update(id, X));
    filter_.set(id, X.covariance.of_specified());
    told_ += " set " + id;
  }
  void observe(const std::string& a, const std::string& b) {
    if (a == b) return;
    const auto X_AB = client_->lookup(a, b);
    REQUIRE(X_AB);
    const double size = random_.index(2) == 0 ? 0.001 : 0.02;
    const Covariance R = random_.covariance(size, size);
    told_ += " observe " + a + " " + b;
    INFO(told_);
    const auto observed = client_->observe(a, b, {X_AB->pose, R});
    if (!observed) FAIL(observed.error().message);
    filter_.observe(path(a, b), R);
  }

  // The derivative of the error of X_AB by those of the edges.
  [[nodiscard]] std::map<std::string, Matrix6d> path(const std::string& a, const std::string& b) {
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
        if (parents_.at(frame).empty() || edges.erase(frame) > 0) continue;
        const auto X_BC = client_->lookup(b, frame);
        REQUIRE(X_BC);
        edges[frame] = sign * adjoint(X_BC->pose);
      }
    };
    toggle(of_a, -1);
    toggle(of_b, 1);
    return edges;
  }

  Random& random_;
  const Covariance Q_ = *Covariance::from_stddev({0.02, 0.02, 0.02, 0.01, 0.01, 0.01});
  std::vector<std::string> names_;
  std::vector<Node> nodes_;
  std::optional<Client> client_;
  std::map<std::string, std::string> parents_;
  DenseFilter filter_;
  Pose G_;
  Time stamp_{std::chrono::seconds(1000)};
  std::size_t frames_ = 0;
  std::string told_;
};

void run(const Join& join, Random& random, std::size_t steps) {
  Robot robot(join, random);
  for (std::size_t i = 0; i < steps; ++i) {
    robot.step();
    if (i % 4 == 3) robot.compare();
  }
}

}  // namespace

TEST_CASE("belief: every pair of frames agrees with a dense joint filter") {
  Random random(20261126);
  INFO("seed " << random.seed());
  for (int i = 0; i < 300; ++i) {
    INFO("run " << i);
    run(testing::join_loopback(), random, 16);
  }
}

TEST_CASE("belief: pairs agree with a dense joint filter over DDS") {
  Random random(20261127);
  INFO("seed " << random.seed());
  run(testing::join_fastdds(), random, 24);
}

}  // namespace tfdude
