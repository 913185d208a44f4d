#include "arguments.hpp"

#include <algorithm>

#include "tfdude/math/transform_spec.hpp"

#include "arrays.hpp"

namespace tfdude::python {

StatedCovariance to_covariance(py::handle covariance, const char* name) {
  if (covariance.is_none()) return {};
  if (py::isinstance<py::str>(covariance)) {
    return value_of(covariance_named(covariance.cast<std::string>()));
  }
  const py::array any = py::array::ensure(covariance);
  if (any && any.ndim() == 1) {
    const Doubles upper = doubles(covariance, {Covariance::kSize}, name);
    Covariance::Upper numbers{};
    std::copy_n(upper.data(), numbers.size(), numbers.begin());
    return value_of(Covariance::from_upper(numbers));
  }
  PyErr_Clear();
  const Doubles matrix = doubles(covariance, {6, 6}, name);
  return value_of(Covariance::from_matrix(to_matrix6(matrix.data())));
}

}  // namespace tfdude::python
