#pragma once

#include <optional>
#include <string>
#include <vector>

#include <pybind11/pybind11.h>

#include "tfdude/types/many.hpp"

namespace tfdude::python {

namespace py = pybind11;

/// Whether it is a sequence or an array, of instants.
[[nodiscard]] bool is_many(py::handle at);
/// Many instants: int64 or float64 arrays (ns, s), datetime64, or a sequence of instants.
/// @param what  its name in messages
/// @throws ValueError for an array of another shape than (N,)
[[nodiscard]] std::vector<Time> to_instants(py::handle at, const char* what);
/// The same, but also None, or a single one. @param many  whether it was several
[[nodiscard]] std::vector<std::optional<Time>> to_stamps(py::handle at, bool& many,
                                                         const char* what);

/// X_AB at many instants, as an object of Python.
[[nodiscard]] py::object trajectory_object(Trajectory trajectory, std::vector<Time> instants);

}  // namespace tfdude::python
