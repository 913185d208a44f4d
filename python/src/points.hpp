#pragma once

#include <vector>

#include <pybind11/pybind11.h>

#include "tfdude/math/point.hpp"

namespace tfdude::python {

namespace py = pybind11;

/// Points (3,) or (N, 3), with a covariance (3, 3) of each or (N, 3, 3), or None.
struct Points {
  std::vector<Point> all;
  bool single = false;  ///< given as (3,)
};
[[nodiscard]] Points to_points(py::handle points, py::handle covariance, bool direction);

/// Points in another frame, as an object of Python.
/// @param transform  the Transform by which they came there
[[nodiscard]] py::object transformed(py::object transform, Points points, Order order);

}  // namespace tfdude::python
