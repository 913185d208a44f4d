#include "arguments.hpp"
#include "session.hpp"

namespace tfdude::python {

py::object exception_of(const Error& error) {
  const UnderWay under_way;
  const py::object make = py::module_::import("tfdude._errors").attr("make");
  // Errors that are none of a lookup have their names in the text only.
  const Error named = error.frame.empty() && error.partition.empty()
                          ? error_of_text(error.code, error.message)
                          : error;
  const auto or_none = [](const std::string& name) -> py::object {
    if (name.empty()) return py::none();
    return py::str(name);
  };
  py::object available = py::none();
  if (error.available) {
    available =
        py::make_tuple(nanoseconds(error.available->from), nanoseconds(error.available->until));
  }
  return make(std::string(to_string(error.code)), error.message, or_none(named.frame),
              or_none(named.partition), available);
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
