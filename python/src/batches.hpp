#pragma once

#include <string>
#include <vector>

#include <pybind11/pybind11.h>

#include "tfdude/math/transform.hpp"

namespace tfdude::python {

namespace py = pybind11;

/// Transforms as arrays: poses (N, 7), each translation, then quaternion (x, y, z, w); or as a
/// sequence of Transforms.
/// @param covariances  None, "exact", one (6, 6) for all, or (N, 6, 6); not with Transforms
/// @param count  how many there must be
/// @throws ValueError and InvalidArgumentException, naming the row
[[nodiscard]] std::vector<Transform> to_transforms(py::handle poses, py::handle covariances,
                                                   std::size_t count);

}  // namespace tfdude::python
