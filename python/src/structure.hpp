#pragma once

#include <string>
#include <utility>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "arguments.hpp"

// The questions about the structure, which a Client and a Recording answer alike.
namespace tfdude::python {

template <class T>
T answer_of(Result<T>&& result) {
  return value_of(std::move(result));
}
template <class T>
T answer_of(T&& value) {
  return std::forward<T>(value);
}

/// @tparam Holder  has call(function), which passes on what answers, without the GIL
template <class Holder, class... Options>
void bind_structure_of(py::class_<Holder, Options...>& cls) {
  cls.def(
      "parent",
      [](Holder& holder, const std::string& id) {
        return answer_of(holder.call([&](auto& asked) { return asked.parent(id); }));
      },
      py::arg("id"), "The id of the parent; '' for a root.");
  cls.def(
      "children",
      [](Holder& holder, const std::string& id) {
        return answer_of(holder.call([&](auto& asked) { return asked.children(id); }));
      },
      py::arg("id"), "The ids of the children, sorted.");
  cls.def(
      "roots",
      [](Holder& holder) {
        return answer_of(holder.call([](auto& asked) { return asked.roots(); }));
      },
      "The ids of frames without an existing parent, sorted.");
  cls.def(
      "frames",
      [](Holder& holder) {
        return answer_of(holder.call([](auto& asked) { return asked.frames(); }));
      },
      "All frames, sorted by id.");
  cls.def(
      "partitions",
      [](Holder& holder) {
        return answer_of(holder.call([](auto& asked) { return asked.partitions(); }));
      },
      "All partitions, also unreachable ones, sorted by name.");
  cls.def(
      "path",
      [](Holder& holder, const std::string& a, const std::string& b) {
        return answer_of(holder.call([&](auto& asked) { return asked.path(a, b); }));
      },
      py::arg("a"), py::arg("b"), "The partitions that a lookup asks, in the order of the path.");
}

}  // namespace tfdude::python
