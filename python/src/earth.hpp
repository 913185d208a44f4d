#pragma once

#include <pybind11/pybind11.h>

namespace tfdude::python {

/// Places on the Earth.
void bind_earth(pybind11::module_& module);

}  // namespace tfdude::python
