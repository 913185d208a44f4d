#pragma once

#include <cstddef>
#include <initializer_list>
#include <vector>

#include <Eigen/Core>
#include <pybind11/numpy.h>

#include "tfdude/math/covariance.hpp"
#include "tfdude/math/pose.hpp"

// Arrays of numpy. Those that are returned are read-only, unless they belong to the caller alone.
namespace tfdude::python {

namespace py = pybind11;

/// Numbers of any kind, order and strides, as an array of contiguous doubles: the caller's own if
/// it is one, else a copy.
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// How many a row of an array has: a pose's quaternion, then its translation; a covariance's rows.
inline constexpr py::ssize_t kPoseNumbers = 7;
inline constexpr std::size_t kCovarianceNumbers = 36;

/// @param shape  -1: any length
/// @param what  the name in messages
/// @throws TypeError if these are no numbers; ValueError if the shape is another
[[nodiscard]] Doubles doubles(py::handle values, std::initializer_list<py::ssize_t> shape,
                              const char* what);

[[nodiscard]] Eigen::Vector3d to_vector3(py::handle values, const char* what);
[[nodiscard]] Twist to_twist(py::handle values, const char* what);
/// Of (x, y, z, w), as scipy and ROS have it.
[[nodiscard]] Eigen::Quaterniond to_quaternion(py::handle xyzw, const char* what);
[[nodiscard]] Eigen::Matrix4d to_matrix4(py::handle values, const char* what);
[[nodiscard]] Matrix6d to_matrix6(const double* row_major);

/// A read-only array with these numbers, row by row.
[[nodiscard]] py::array read_only(const double* values, std::vector<py::ssize_t> shape);
[[nodiscard]] py::array from_vector3(const Eigen::Vector3d& vector);
[[nodiscard]] py::array from_twist(const Twist& twist);
[[nodiscard]] py::array from_matrix4(const Eigen::Matrix4d& matrix);
[[nodiscard]] py::array from_matrix6(const Matrix6d& matrix);

/// Read-only views of a pose's own numbers, which keep its owner alive.
[[nodiscard]] py::array translation_view(const Pose& pose, py::handle owner);
[[nodiscard]] py::array quaternion_view(const Pose& pose, py::handle owner);

}  // namespace tfdude::python
