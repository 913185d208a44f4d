#include "batches.hpp"

#include <algorithm>

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bind.hpp"
#include "client.hpp"

namespace tfdude::python {
namespace {

template <class T>
T of_row(Result<T>&& result, std::size_t row) {
  if (!result)
    raise({result.error().code, "row " + std::to_string(row) + ": " + result.error().message});
  return *std::move(result);
}

Pose pose_of(const double* numbers, std::size_t row) {
  return of_row(Pose::create({numbers[6], numbers[3], numbers[4], numbers[5]},
                             {numbers[0], numbers[1], numbers[2]}),
                row);
}

std::vector<Transform> of_sequence(py::handle transforms, std::size_t count) {
  const auto sequence = py::reinterpret_borrow<py::sequence>(transforms);
  if (sequence.size() != count) {
    throw py::value_error("poses must be " + std::to_string(count) + ", not " +
                          std::to_string(sequence.size()));
  }
  std::vector<Transform> X;
  X.reserve(count);
  for (const py::handle one : sequence) X.push_back(one.cast<const Transform&>());
  return X;
}

bool is_sequence_of_transforms(py::handle poses) {
  if (py::isinstance<py::array>(poses) || !py::isinstance<py::sequence>(poses)) return false;
  const auto sequence = py::reinterpret_borrow<py::sequence>(poses);
  return sequence.size() > 0 && py::isinstance<Transform>(py::object(sequence[0]));
}

}  // namespace

std::vector<Transform> to_transforms(py::handle poses, py::handle covariances, std::size_t count) {
  if (is_sequence_of_transforms(poses)) {
    if (!covariances.is_none()) throw py::type_error("Transforms have their covariances already");
    return of_sequence(poses, count);
  }
  const auto rows = static_cast<py::ssize_t>(count);
  const Doubles numbers = doubles(poses, {rows, kPoseNumbers}, "poses");
  const py::array any = py::isinstance<py::str>(covariances) || covariances.is_none()
                            ? py::array()
                            : py::array::ensure(covariances);
  PyErr_Clear();
  const bool each = any && any.ndim() == 3;
  const StatedCovariance common = each ? StatedCovariance() : to_covariance(covariances);
  const Doubles matrices = each ? doubles(covariances, {rows, 6, 6}, "covariances") : Doubles();
  std::vector<Transform> X(count);
  for (std::size_t i = 0; i < count; ++i) {
    X[i].pose = pose_of(numbers.data() + i * kPoseNumbers, i);
    X[i].covariance = common;
    if (!each) continue;
    X[i].covariance =
        of_row(Covariance::from_matrix(to_matrix6(matrices.data() + i * kCovarianceNumbers)), i);
  }
  return X;
}

}  // namespace tfdude::python
