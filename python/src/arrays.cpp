#include "arrays.hpp"

#include <cmath>
#include <string>
#include <type_traits>

#include <Eigen/Geometry>

#include "arguments.hpp"

namespace tfdude::python {
namespace {

std::string shape_text(std::initializer_list<py::ssize_t> shape) {
  std::string text = "(";
  for (const py::ssize_t length : shape) {
    text += (length < 0 ? "N" : std::to_string(length)) + ", ";
  }
  text.pop_back();
  if (shape.size() > 1) text.pop_back();
  return text + ")";
}

py::array view(const double* first, py::ssize_t count, py::handle owner) {
  py::array array(py::dtype::of<double>(), {count}, {py::ssize_t{sizeof(double)}}, first, owner);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

static_assert(std::is_standard_layout_v<Pose> && sizeof(Pose) == kPoseNumbers * sizeof(double));
const double* numbers(const Pose& pose) {
  return reinterpret_cast<const double*>(&pose);  // the address of its first member
}

}  // namespace

Doubles doubles(py::handle values, std::initializer_list<py::ssize_t> shape, const char* what) {
  // As numpy itself sees it: complex numbers, texts and objects are no doubles.
  const py::array any = py::array::ensure(values);
  const char kind = any ? any.dtype().kind() : 'O';
  if (kind != 'f' && kind != 'i' && kind != 'u') {
    PyErr_Clear();
    throw py::type_error(std::string(what) + " must be numbers");
  }
  bool fits = any.ndim() == static_cast<py::ssize_t>(shape.size());
  for (std::size_t i = 0; fits && i < shape.size(); ++i) {
    const py::ssize_t expected = shape.begin()[i];
    fits = expected < 0 || any.shape(static_cast<py::ssize_t>(i)) == expected;
  }
  if (!fits) {
    throw py::value_error(std::string(what) + " must have the shape " + shape_text(shape) +
                          ", not " + std::string(py::str(any.attr("shape"))));
  }
  return Doubles(any);
}

Eigen::Vector3d to_vector3(py::handle values, const char* what) {
  const Doubles array = doubles(values, {3}, what);
  return Eigen::Map<const Eigen::Vector3d>(array.data());
}

Twist to_twist(py::handle values, const char* what) {
  const Doubles array = doubles(values, {6}, what);
  return Eigen::Map<const Twist>(array.data());
}

Eigen::Quaterniond to_quaternion(py::handle xyzw, const char* what) {
  const Doubles array = doubles(xyzw, {4}, what);
  const double* q = array.data();
  return {q[3], q[0], q[1], q[2]};
}

Eigen::Matrix4d to_matrix4(py::handle values, const char* what) {
  const Doubles array = doubles(values, {4, 4}, what);
  return Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(array.data());
}

Matrix6d to_matrix6(const double* row_major) {
  return Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(row_major);
}

py::array read_only(const double* values, std::vector<py::ssize_t> shape) {
  py::array array = py::array_t<double>(std::move(shape), values);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

py::array from_vector3(const Eigen::Vector3d& vector) { return read_only(vector.data(), {3}); }
py::array from_twist(const Twist& twist) { return read_only(twist.data(), {6}); }

py::array from_matrix4(const Eigen::Matrix4d& matrix) {
  const Eigen::Matrix4d by_rows = matrix.transpose();
  return read_only(by_rows.data(), {4, 4});
}

py::array from_matrix6(const Matrix6d& matrix) {
  const Matrix6d by_rows = matrix.transpose();
  return read_only(by_rows.data(), {6, 6});
}

py::array translation_view(const Pose& pose, py::handle owner) {
  return view(numbers(pose) + 4, 3, owner);
}
py::array quaternion_view(const Pose& pose, py::handle owner) {
  return view(numbers(pose), 4, owner);
}

}  // namespace tfdude::python
