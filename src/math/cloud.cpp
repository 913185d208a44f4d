#include "tfdude/math/cloud.hpp"

#include <cstring>

#include "math/cloud_map.hpp"
#include "math/processor.hpp"

namespace tfdude {
namespace {

using cloud::Map;

using V4 = double __attribute__((vector_size(32)));
using F4 = float __attribute__((vector_size(16)));

namespace any {
#include "math/cloud_body.ipp"
}  // namespace any

#if defined(TFDUDE_HAS_AVX2)
#pragma GCC push_options
#pragma GCC target("avx2,fma")
namespace avx2 {
#include "math/cloud_body.ipp"  // NOLINT(readability-duplicate-include): for another processor
}  // namespace avx2
#pragma GCC pop_options
#endif

template <class Number, int kRows>
void transform_all(const Map& map, const Number* p_B, std::size_t count, Number* p_A,
                   Number* covariances) {
#if defined(TFDUDE_HAS_AVX2)
  if (kAvx2) return avx2::transform_cloud<Number, kRows>(map, p_B, count, p_A, covariances);
#endif
  any::transform_cloud<Number, kRows>(map, p_B, count, p_A, covariances);
}

// A matrix whose columns are apart is transformed column by column.
template <class Number, int kRows, class From, class To>
void transform_columns(const Map& map, const From& p_B, To& p_A, Number* covariances,
                       Eigen::Index stride) {
  const auto count = static_cast<std::size_t>(p_B.cols());
  if (p_B.outerStride() == 3 && p_A.outerStride() == 3 && stride == kRows) {
    return transform_all<Number, kRows>(map, p_B.data(), count, p_A.data(), covariances);
  }
  for (Eigen::Index i = 0; i < p_B.cols(); ++i) {
    transform_all<Number, kRows>(map, p_B.data() + i * p_B.outerStride(), 1,
                                 p_A.data() + i * p_A.outerStride(),
                                 covariances != nullptr ? covariances + i * stride : nullptr);
  }
}

template <class Number, int kRows, class From, class To, class Sigma>
void with_covariances(const Transform& X_AB, const From& p_B, To& p_A, Sigma& sigma,
                      const Eigen::Matrix3d& own) {
  transform_columns<Number, kRows>(cloud::map_of(X_AB, own), p_B, p_A, sigma.data(),
                                   sigma.outerStride());
}

}  // namespace

namespace cloud {

Map map_of(const Transform& X_AB, const Eigen::Matrix3d& own) {
  Map map = map_of(X_AB.pose);
  const Eigen::Matrix3d R = X_AB.pose.rotation().toRotationMatrix();
  const Matrix6d sigma = X_AB.covariance.of_specified().matrix();
  const Eigen::Matrix3d P = R * (sigma.topLeftCorner<3, 3>() + own) * R.transpose();
  const Eigen::Matrix3d C = R * sigma.topRightCorner<3, 3>() * R.transpose();
  const Eigen::Matrix3d Q = R * sigma.bottomRightCorner<3, 3>() * R.transpose();
  int k = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) map.P[k++] = P(i, j);
    for (int j = 0; j < 3; ++j) {
      map.C[i][j] = C(i, j);
      map.half_Q[i][j] = 0.5 * Q(i, j);
    }
  }
  return map;
}

Map map_of(const Pose& X_AB) {
  Map map;
  const Eigen::Matrix3d R = X_AB.rotation().toRotationMatrix();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) map.R[i][j] = R(i, j);
    map.t[i] = X_AB.translation()[i];
  }
  return map;
}

template <class Number>
void transform_points(const Map& map, const Number* p_B, std::size_t count, Number* p_A,
                      Number* covariances) {
  if (covariances == nullptr) return transform_all<Number, 0>(map, p_B, count, p_A, nullptr);
  transform_all<Number, 6>(map, p_B, count, p_A, covariances);
}
template void transform_points(const Map&, const double*, std::size_t, double*, double*);
template void transform_points(const Map&, const float*, std::size_t, float*, float*);

}  // namespace cloud

void transform_cloud(const Pose& X_AB, const Eigen::Ref<const Eigen::Matrix3Xd>& p_B,
                     Eigen::Ref<Eigen::Matrix3Xd> p_A) {
  transform_columns<double, 0>(cloud::map_of(X_AB), p_B, p_A, nullptr, 0);
}

void transform_cloud(const Pose& X_AB, const Eigen::Ref<const Eigen::Matrix3Xf>& p_B,
                     Eigen::Ref<Eigen::Matrix3Xf> p_A) {
  transform_columns<float, 0>(cloud::map_of(X_AB), p_B, p_A, nullptr, 0);
}

void transform_cloud(const Transform& X_AB, const Eigen::Ref<const Eigen::Matrix3Xd>& p_B,
                     Eigen::Ref<Eigen::Matrix3Xd> p_A,
                     Eigen::Ref<CloudCovariances<double>> covariances, const Eigen::Matrix3d& own) {
  with_covariances<double, 6>(X_AB, p_B, p_A, covariances, own);
}

void transform_cloud(const Transform& X_AB, const Eigen::Ref<const Eigen::Matrix3Xf>& p_B,
                     Eigen::Ref<Eigen::Matrix3Xf> p_A,
                     Eigen::Ref<CloudCovariances<float>> covariances, const Eigen::Matrix3d& own) {
  with_covariances<float, 6>(X_AB, p_B, p_A, covariances, own);
}

void transform_cloud_matrices(const Transform& X_AB, const Eigen::Ref<const Eigen::Matrix3Xd>& p_B,
                              Eigen::Ref<Eigen::Matrix3Xd> p_A,
                              Eigen::Ref<CloudMatrices<double>> covariances,
                              const Eigen::Matrix3d& own) {
  with_covariances<double, 9>(X_AB, p_B, p_A, covariances, own);
}

void transform_cloud_matrices(const Transform& X_AB, const Eigen::Ref<const Eigen::Matrix3Xf>& p_B,
                              Eigen::Ref<Eigen::Matrix3Xf> p_A,
                              Eigen::Ref<CloudMatrices<float>> covariances,
                              const Eigen::Matrix3d& own) {
  with_covariances<float, 9>(X_AB, p_B, p_A, covariances, own);
}

}  // namespace tfdude
