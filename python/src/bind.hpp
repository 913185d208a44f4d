#pragma once

#include <string>

#include <pybind11/pybind11.h>

#include "tfdude/math/transform.hpp"

#include "arguments.hpp"

// Each adds its classes and functions to the module.
namespace tfdude::python {

void bind_transform(py::module_& module);
void bind_points(py::module_& module);
/// What calls return: stamped transforms, frames, partitions, changes ...
void bind_values(py::module_& module);
/// What a partition consists of: frames, joints, configurations.
void bind_frames(py::module_& module);
void bind_client(py::module_& module);
void bind_node(py::module_& module);
void bind_recording(py::module_& module);
/// Call it last: values of the other classes can then be pickled and copied.
void bind_pickling(py::module_& module);

/// Six standard deviations: three [m], three [rad].
[[nodiscard]] StatedCovariance from_stddev(py::handle stddev);

/// Raises UnspecifiedCovariance, naming the edges if they are known, if a transform's is not
/// complete.
void require_complete(py::handle transform);
[[noreturn]] void raise_unspecified(const std::string& message);

}  // namespace tfdude::python
