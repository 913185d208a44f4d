#pragma once

#include <Eigen/Core>

#include "tfdude/base/export.hpp"
#include "tfdude/math/transform.hpp"

// Clouds of points: the same as transform() of single points (point.hpp) to second order, for
// millions of them. They are columns of matrices, in double or single precision; the arithmetic is
// in double precision. Results may not overlap with what they are computed from, except that points
// may be transformed in place.
namespace tfdude {

/// Covariances, one a point: xx, xy, xz, yy, yz, zz, in a column each.
template <class Number>
using CloudCovariances = Eigen::Matrix<Number, 6, Eigen::Dynamic>;
/// The same as whole 3x3 matrices, whose nine numbers are a column each.
template <class Number>
using CloudMatrices = Eigen::Matrix<Number, 9, Eigen::Dynamic>;

/// p_A = X_AB p_B of each point. Sizes must be equal. O(points); 1 ns for each, which is the speed
/// of memory. Does not allocate.
TFDUDE_EXPORT void transform_cloud(const Pose& X_AB, const Eigen::Ref<const Eigen::Matrix3Xd>& p_B,
                                   Eigen::Ref<Eigen::Matrix3Xd> p_A);
TFDUDE_EXPORT void transform_cloud(const Pose& X_AB, const Eigen::Ref<const Eigen::Matrix3Xf>& p_B,
                                   Eigen::Ref<Eigen::Matrix3Xf> p_A);

/// And the covariance of each p_A, of the error of X_AB and the points' own one. Edges whose
/// covariance is unspecified count as known exactly: see StatedCovariance::complete().
/// @param own  covariance of each point's own error, in B [m²]
TFDUDE_EXPORT void transform_cloud(const Transform& X_AB,
                                   const Eigen::Ref<const Eigen::Matrix3Xd>& p_B,
                                   Eigen::Ref<Eigen::Matrix3Xd> p_A,
                                   Eigen::Ref<CloudCovariances<double>> covariances,
                                   const Eigen::Matrix3d& own = Eigen::Matrix3d::Zero());
TFDUDE_EXPORT void transform_cloud(const Transform& X_AB,
                                   const Eigen::Ref<const Eigen::Matrix3Xf>& p_B,
                                   Eigen::Ref<Eigen::Matrix3Xf> p_A,
                                   Eigen::Ref<CloudCovariances<float>> covariances,
                                   const Eigen::Matrix3d& own = Eigen::Matrix3d::Zero());
/// As above, with whole matrices.
TFDUDE_EXPORT void transform_cloud_matrices(const Transform& X_AB,
                                            const Eigen::Ref<const Eigen::Matrix3Xd>& p_B,
                                            Eigen::Ref<Eigen::Matrix3Xd> p_A,
                                            Eigen::Ref<CloudMatrices<double>> covariances,
                                            const Eigen::Matrix3d& own = Eigen::Matrix3d::Zero());
TFDUDE_EXPORT void transform_cloud_matrices(const Transform& X_AB,
                                            const Eigen::Ref<const Eigen::Matrix3Xf>& p_B,
                                            Eigen::Ref<Eigen::Matrix3Xf> p_A,
                                            Eigen::Ref<CloudMatrices<float>> covariances,
                                            const Eigen::Matrix3d& own = Eigen::Matrix3d::Zero());

}  // namespace tfdude
