#include "arguments.hpp"

namespace tfdude::python {

void raise(const Error& error) {
  const py::object make = py::module_::import("tfdude._errors").attr("make");
  const py::object exception = make(std::string(to_string(error.code)), error.message);
  PyErr_SetObject(py::type::handle_of(exception).ptr(), exception.ptr());
  throw py::error_already_set();
}

}  // namespace tfdude::python
