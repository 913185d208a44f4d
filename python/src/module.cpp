#include "tfdude/types/version.hpp"

#include "arrays.hpp"
#include "bind.hpp"
#include "earth.hpp"
#include "session.hpp"

PYBIND11_MODULE(_core, module) {
  namespace py = pybind11;
  using namespace tfdude::python;
  module.doc() = "The extension module of the package tfdude.";
  // The first array would import numpy, within the initialization of a static variable. A second
  // thread would wait for that with the GIL, which the import needs.
  (void)py::detail::npy_api::get();
  module.attr("__version__") = tfdude::program_version();
  bind_transform(module);
  bind_earth(module);
  bind_points(module);
  bind_values(module);
  bind_frames(module);
  bind_client(module);
  bind_node(module);
  bind_recording(module);
  bind_pickling(module);
  py::module_::import("atexit").attr("register")(py::cpp_function(&finish));
}
