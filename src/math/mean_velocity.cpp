#include "math/mean_velocity.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "tfdude/math/perturbation.hpp"

#include "math/drift.hpp"
#include "math/instant_sources.hpp"

namespace tfdude {
namespace {

using Way = ObservedEdge::Way;

// What maps errors of an edge, or of a source, at both ends to that of the velocity, but for the
// sign of the first.
struct Gains {
  Matrix6d before;
  Matrix6d after;
};

Covariance mapped(const Matrix6d& G, const Covariance& sigma) {
  const Matrix6d all = G * sigma.matrix() * G.transpose();
  return Covariance::trusted(Matrix6d(0.5 * (all + all.transpose())));
}

Covariance squared(const Loading& F) { return Covariance::trusted(Matrix6d(F * F.transpose())); }

bool is_zero(const Covariance& sigma) { return sigma.upper() == Covariance::Upper{}; }

void add_columns(Loading& sum, const Loading& more) {
  const Eigen::Index columns = std::max(sum.cols(), more.cols());
  const Eigen::Index before = sum.cols();
  sum.conservativeResize(6, columns);
  sum.rightCols(columns - before).setZero();
  sum.leftCols(more.cols()) += more;
}

// A source, with what the edges of the path make of it.
struct Shared {
  std::string name;
  Loading before = Loading(6, 0);
  Loading after = Loading(6, 0);
  bool lasts = true;  // it is the same error at both ends
};

// How the error at the end follows from that at the beginning, if it does.
std::optional<Drift> drift_of(const EdgeAtEnds& edge) {
  if (edge.fixed) return Drift{};
  return edge.drifts ? drift_between(edge.before, edge.after) : std::nullopt;
}

class Sum {
 public:
  void add(EdgeAtEnds edge, const Gains& gains) {
    const std::optional<Drift> drift = drift_of(edge);
    const bool lasts =
        drift.has_value() || (edge.drifts && are_corrected_together(edge.before, edge.after));
    if (!lasts) allow_any_tie(edge, gains);
    total_ += of_ends(drift, gains, edge.before.own, edge.after.own);
    add_unknown(edge, gains);
    for (const CommonError& one : edge.before.common_errors) {
      if (!one.subtracts) add_columns(shared(one, lasts).before, gains.before * one.loading);
    }
    for (const CommonError& one : edge.after.common_errors) {
      if (!one.subtracts) add_columns(shared(one, lasts).after, gains.after * one.loading);
    }
  }

  void finish(MeanVelocity& velocity) {
    std::vector<OfSource> parts;
    for (Shared& source : shared_) {
      if (is_made(source.name) && source.before.isZero(0) && source.after.isZero(0)) continue;
      if (source.lasts) {
        Loading difference = -source.before;
        add_columns(difference, source.after);
        parts.emplace_back(source.name, squared(difference));
      } else {
        parts.emplace_back(source.name, bound(squared(source.before), squared(source.after)));
        bound_ = true;
      }
      const std::string shown(shown_source(source.name));
      const auto& all = velocity.sources;
      if (std::count(all.begin(), all.end(), shown) == 0) velocity.sources.push_back(shown);
    }
    total_ += sum_of_sources(parts, bound_);
    velocity.covariance = unknown_ ? bound(total_, *unknown_) : total_;
    velocity.bound = bound_;
  }

 private:
  [[nodiscard]] Covariance of_ends(const std::optional<Drift>& drift, const Gains& gains,
                                   const Covariance& before, const Covariance& after) {
    if (drift) {
      Covariance share = mapped(gains.after * drift->F - gains.before, before);
      share += mapped(gains.after, drift->added);
      return share;
    }
    if (!is_zero(before) || !is_zero(after)) bound_ = true;
    return bound(mapped(gains.before, before), mapped(gains.after, after));
  }

  // The errors at both ends may be correlated in any way. What an observation has left of one adds
  // to those of other edges, so the other one may be correlated with these, too.
  void allow_any_tie(EdgeAtEnds& edge, const Gains& gains) {
    const auto adds = [](const Belief& X) {
      return std::any_of(X.common_errors.begin(), X.common_errors.end(),
                         [](const CommonError& one) { return !one.subtracts && ties(one); });
    };
    const bool keeps_before = adds(edge.before);
    if (!keeps_before && !adds(edge.after)) return;
    const Matrix6d& gain = keeps_before ? gains.after : gains.before;
    add_unknown(mapped(gain, take_whole(keeps_before ? edge.after : edge.before)));
  }

  void add_unknown(const EdgeAtEnds& edge, const Gains& gains) {
    if (!edge.before.unknown && !edge.after.unknown) return;
    const Covariance share = of_ends(edge.fixed ? drift_of(edge) : std::nullopt, gains,
                                     edge.before.unknown.value_or(Covariance()),
                                     edge.after.unknown.value_or(Covariance()));
    add_unknown(share);
  }
  void add_unknown(const Covariance& share) {
    unknown_ = unknown_ ? bound(*unknown_, share) : share;
    bound_ = true;
  }

  Shared& shared(const CommonError& common_error, bool lasts) {
    auto found = std::find_if(shared_.begin(), shared_.end(),
                              [&](const Shared& one) { return one.name == common_error.source; });
    if (found == shared_.end()) {
      shared_.push_back({common_error.source});
      found = std::prev(shared_.end());
    }
    found->lasts = found->lasts && lasts;
    return *found;
  }

  Covariance total_;
  std::optional<Covariance> unknown_;
  std::vector<Shared> shared_;
  bool bound_ = false;
};

// An edge of the path, from its frame nearer to A to the one nearer to B.
Pose along(const Pose& X_PC, Way way) { return way == Way::kUp ? X_PC.inverse() : X_PC; }

// From the error of X_PC to that of X_AB, with the pose of B in the far frame of the edge.
Matrix6d carried(const Pose& along_edge, Way way, const Pose& beyond) {
  if (way != Way::kUp) return adjoint(beyond.inverse());
  return -adjoint((along_edge * beyond).inverse());
}

// A source that an edge makes last is one error at both ends.
void join_lasting_sources(std::vector<EdgeAtEnds>& path) {
  std::vector<ErrorsOfEdge> all;
  for (EdgeAtEnds& edge : path) {
    const bool lasts = edge.fixed || edge.drifts;
    all.push_back({&edge.before.common_errors, lasts});
    all.push_back({&edge.after.common_errors, lasts});
  }
  join_lasting(all);
}

}  // namespace

MeanVelocity mean_velocity(std::vector<EdgeAtEnds> path, double seconds) {
  join_lasting_sources(path);
  Pose X0;
  Pose X1;
  for (const EdgeAtEnds& edge : path) {
    X0 = X0 * along(edge.before.pose, edge.way);
    X1 = X1 * along(edge.after.pose, edge.way);
  }
  const Eigen::Quaterniond turned = X1.rotation() * X0.rotation().conjugate();
  Twist phi = log(Pose::trusted(turned, Eigen::Vector3d::Zero()));
  phi.head<3>().setZero();
  MeanVelocity velocity;
  velocity.linear = (X1.translation() - X0.translation()) / seconds;
  velocity.angular = phi.tail<3>() / seconds;

  const Eigen::Matrix3d R0 = X0.rotation().toRotationMatrix();
  const Eigen::Matrix3d R1 = X1.rotation().toRotationMatrix();
  const Eigen::Matrix3d Jr = right_jacobian(phi).bottomRightCorner<3, 3>();
  Gains of_path{Matrix6d::Zero(), Matrix6d::Zero()};
  of_path.before.topLeftCorner<3, 3>() = R0 / seconds;
  of_path.after.topLeftCorner<3, 3>() = R1 / seconds;
  of_path.before.bottomRightCorner<3, 3>() = Jr.inverse() * R0 / seconds;
  of_path.after.bottomRightCorner<3, 3>() = of_path.before.bottomRightCorner<3, 3>();
  Sum sum;
  Pose beyond0;
  Pose beyond1;
  for (auto edge = path.rbegin(); edge != path.rend(); ++edge) {
    const Pose before = along(edge->before.pose, edge->way);
    const Pose after = along(edge->after.pose, edge->way);
    sum.add(*edge, {of_path.before * carried(before, edge->way, beyond0),
                    of_path.after * carried(after, edge->way, beyond1)});
    beyond0 = before * beyond0;
    beyond1 = after * beyond1;
  }
  sum.finish(velocity);
  return velocity;
}

}  // namespace tfdude
