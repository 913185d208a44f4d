#include "arguments.hpp"

namespace tfdude::python {

py::object exception_of(const Error& error) {
  const py::object make = py::module_::import("tfdude._errors").attr("make");
  return make(std::string(to_string(error.code)), error.message);
}

void raise(const Error& error) {
  const py::object exception = exception_of(error);
  PyErr_SetObject(py::type::handle_of(exception).ptr(), exception.ptr());
  throw py::error_already_set();
}

}  // namespace tfdude::python
