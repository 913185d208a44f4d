#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bind.hpp"
#include "client.hpp"

namespace tfdude::python {
namespace {

void bind_cause(py::module_& module) {
  py::class_<Cause>(module, "Cause", "Why there is no answer: see Client.why().")
      .def_property_readonly(
          "obstacle", [](const Cause& cause) { return to_string(cause.obstacle); },
          "What stands in the way: 'unknown_frame', 'owner_lost', 'ends_before', ...")
      .def_readonly("frame", &Cause::frame, "That is missing, or whose edge is the cause.")
      .def_readonly("partition", &Cause::partition, "Its owner; empty: not known.")
      .def_property_readonly(
          "since", [](const Cause& cause) { return from_stamp(cause.since); },
          "Since when [ns]: of the newest sample, or of the loss; or None.")
      .def_readonly("needs", &Cause::needs, "What would help.")
      .def_readonly("similar", &Cause::similar, "Ids that are nearly the missing one.")
      .def_property_readonly(
          "clock_ahead",
          [](const Cause& cause) -> py::object {
            if (!cause.clock_ahead) return py::none();
            return py::float_(to_seconds(*cause.clock_ahead));
          },
          "How far the clock of the owner's host is ahead [s], if that matters; or None.")
      .def_property_readonly(
          "error", [](const Cause& cause) { return exception_of(cause.error); },
          "The exception of lookup().")
      .def("__repr__", [](const Cause& cause) {
        return std::string("Cause(") + to_string(cause.obstacle) + ": needs " + cause.needs + ")";
      });
}

py::list shares_of(const std::vector<VarianceShare>& shares) {
  py::list list;
  for (const VarianceShare& one : shares) {
    list.append(py::make_tuple(one.name, one.variance, one.share));
  }
  return list;
}

void bind_explanation(py::module_& module) {
  py::class_<Explanation>(module, "Explanation", "The answer to Client.why().")
      .def_readonly("transform", &Explanation::X_AB, "The answer of lookup(); None: see `cause`.")
      .def_readonly("cause", &Explanation::cause, "Why there is none; or None.")
      .def_property_readonly(
          "direction", [](const Explanation& e) { return from_vector3(e.direction); },
          "(3,) in which the position is the least certain, along the axes of a; or, if the\n"
          "position is known exactly, the axis of b about which the rotation is.")
      .def_readonly("is_rotation", &Explanation::is_rotation)
      .def_readonly("variance", &Explanation::variance, "In that direction [m² or rad²].")
      .def_property_readonly(
          "edges", [](const Explanation& e) { return shares_of(e.edges); },
          "[(frame, variance, share)] of own errors, the greatest first.")
      .def_property_readonly(
          "sources", [](const Explanation& e) { return shares_of(e.sources); },
          "[(source, variance, share)] of common errors.")
      .def_property_readonly(
          "joints", [](const Explanation& e) { return shares_of(e.joints); },
          "[(joint, variance, share)] of those edges that a joint moves.")
      .def_property_readonly(
          "best",
          [](const Explanation& e) -> py::object {
            if (!e.best) return py::none();
            return py::make_tuple(e.best->a, e.best->b, e.best->variance_after);
          },
          "(a, b, variance after it) of the measurement of one edge that would help most; or None.")
      .def_readonly("assumed_joints", &Explanation::assumed_joints, "That nobody has measured.")
      .def_property_readonly(
          "owners",
          [](const Explanation& e) {
            py::list list;
            for (const OwnerAge& one : e.owners) {
              py::object age = py::none();
              if (one.age) age = py::float_(to_seconds(*one.age));
              list.append(py::make_tuple(one.partition, one.slowest, from_stamp(one.newest), age));
            }
            return list;
          },
          "[(partition, its slowest dynamic edge, newest stamp [ns], age [s])] along the path.")
      .def("__repr__", [](const Explanation& e) {
        if (e.cause) return std::string(py::repr(py::cast(*e.cause)));
        std::string text = "Explanation(variance " + std::to_string(e.variance);
        if (!e.edges.empty()) text += ", most of it by edge '" + e.edges.front().name + "'";
        return text + ")";
      });
}

}  // namespace

void bind_explanations(py::module_& module, ClientClass& cls) {
  bind_cause(module);
  bind_explanation(module);
  cls.def(
      "why",
      [](const Session& session, const std::string& a, const std::string& b, py::handle at,
         py::handle sensor) {
        WhyQuery query;
        query.at = to_stamp(at, "at");
        if (!sensor.is_none()) {
          const Doubles stddev = doubles(sensor, {6}, "sensor");
          std::copy_n(stddev.data(), query.sensor.size(), query.sensor.begin());
        }
        return session.call([&](Client& c) { return c.why(a, b, query); });
      },
      py::arg("a"), py::arg("b"), py::arg("at") = py::none(), py::kw_only(),
      py::arg("sensor") = py::none(),
      "Explains lookup(a, b): how its variance is made up, and which measurement would reduce it;\n"
      "or why there is no answer, and what would help: an Explanation. Does not raise.\n\n"
      "sensor: six standard deviations of a possible measurement of an edge (1 mm, 1 mrad).");
}

}  // namespace tfdude::python
