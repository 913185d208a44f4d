#include "support/oracle.hpp"

#include <algorithm>

#include <Eigen/LU>

namespace tfdude::testing {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

// Solà et al., arXiv:1812.01537, Eq. 175: [R, [t]×R; 0, R], translation first.
Matrix6 adjoint_of(const Eigen::Matrix4d& X) {
  const Eigen::Matrix3d R = X.topLeftCorner<3, 3>();
  const Eigen::Vector3d t = X.topRightCorner<3, 1>();
  Eigen::Matrix3d t_cross;
  t_cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  Matrix6 Ad = Matrix6::Zero();
  Ad.topLeftCorner<3, 3>() = R;
  Ad.topRightCorner<3, 3>() = t_cross * R;
  Ad.bottomRightCorner<3, 3>() = R;
  return Ad;
}

}  // namespace

Oracle::Value Oracle::value_of(const Transform& X) {
  Value value;
  value.complete = X.covariance.complete();
  value.X.topLeftCorner<3, 3>() = X.pose.rotation().toRotationMatrix();
  value.X.topRightCorner<3, 1>() = X.pose.translation();
  const Covariance::Upper& upper = X.covariance.of_specified().upper();
  std::size_t next = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) {
      value.sigma(row, column) = value.sigma(column, row) = upper[next++];
    }
  }
  return value;
}

// X̄ Exp(ξ) inverted is Exp(-ξ) X̄⁻¹ = X̄⁻¹ Exp(-Ad(X̄) ξ).
Oracle::Value Oracle::inverse(const Value& X_AB) {
  const Matrix6 Ad = adjoint_of(X_AB.X);
  return {X_AB.X.inverse(), Ad * X_AB.sigma * Ad.transpose(), X_AB.complete};
}

// X̄ Exp(ξ) Ȳ Exp(η) = X̄ Ȳ Exp(Ad(Ȳ⁻¹) ξ) Exp(η), to first order the sum of both.
Oracle::Value Oracle::compose(const Value& X_AB, const Value& X_BC) {
  const Matrix6 Ad = adjoint_of(X_BC.X.inverse());
  return {X_AB.X * X_BC.X, Ad * X_AB.sigma * Ad.transpose() + X_BC.sigma,
          X_AB.complete && X_BC.complete};
}

void Oracle::add(const std::string& id, const std::string& parent, const Transform& X_PC) {
  frames_[id] = {parent, value_of(X_PC)};
}

void Oracle::update(const std::string& id, const Transform& X_PC) {
  frames_.at(id).X_PC = value_of(X_PC);
}

void Oracle::remove(const std::string& id) {
  std::vector<std::string> gone;
  for (const std::string& other : ids()) {
    if (is_below(other, id)) gone.push_back(other);
  }
  for (const std::string& other : gone) frames_.erase(other);
}

std::vector<std::string> Oracle::ids() const {
  std::vector<std::string> ids;
  for (const auto& [id, frame] : frames_) ids.push_back(id);
  return ids;
}

std::vector<std::string> Oracle::way_up(const std::string& id) const {
  std::vector<std::string> way;
  for (auto frame = frames_.find(id); frame != frames_.end();
       frame = frames_.find(frame->second.parent)) {
    way.push_back(frame->first);
  }
  return way;
}

bool Oracle::is_below(const std::string& id, const std::string& ancestor) const {
  const auto way = way_up(id);
  return std::find(way.begin(), way.end(), ancestor) != way.end();
}

Transform Oracle::between(const std::string& a, const std::string& b) const {
  auto from_a = way_up(a);
  auto from_b = way_up(b);
  // The edges above the common ancestor are no part of the path.
  while (!from_a.empty() && !from_b.empty() && from_a.back() == from_b.back()) {
    from_a.pop_back();
    from_b.pop_back();
  }
  Value X_AB;
  for (const std::string& id : from_a) X_AB = compose(X_AB, inverse(frames_.at(id).X_PC));
  std::reverse(from_b.begin(), from_b.end());
  for (const std::string& id : from_b) X_AB = compose(X_AB, frames_.at(id).X_PC);
  const Eigen::Matrix3d R = X_AB.X.topLeftCorner<3, 3>();
  const Eigen::Vector3d t = X_AB.X.topRightCorner<3, 1>();
  const auto sigma = Covariance::trusted(X_AB.sigma);
  return {Pose::trusted(Eigen::Quaterniond(R).normalized(), t),
          StatedCovariance::trusted(sigma.upper(), X_AB.complete)};
}

}  // namespace tfdude::testing
