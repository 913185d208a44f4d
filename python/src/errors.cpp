#include "arguments.hpp"
#include "session.hpp"

namespace tfdude::python {

py::object exception_of(const Error& error) {
  const UnderWay under_way;
  const py::object make = py::module_::import("tfdude._errors").attr("make");
  return make(std::string(to_string(error.code)), error.message);
}

void raise(const Error& error) {
  if (exiting()) {
    // Ends the thread without a word. And it runs no code of Python: a thread that comes back to it
    // while the interpreter ends is killed, which C++ does not survive.
    PyErr_SetString(PyExc_SystemExit, "the interpreter ends");
    throw py::error_already_set();
  }
  const py::object exception = exception_of(error);
  PyErr_SetObject(py::type::handle_of(exception).ptr(), exception.ptr());
  throw py::error_already_set();
}

}  // namespace tfdude::python
