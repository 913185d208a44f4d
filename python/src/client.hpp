#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <pybind11/pybind11.h>

#include "tfdude/types/options.hpp"

#include "session.hpp"

namespace tfdude {
class LoopbackNetwork;
}  // namespace tfdude

namespace tfdude::python {

using ClientClass = py::class_<Session, std::shared_ptr<Session>>;

/// What Client and Node are opened with. Absent: the default of Options.
struct OpenArguments {
  std::optional<std::uint32_t> domain;
  std::optional<std::string> profile;
  std::optional<std::string> discovery_server;
  std::optional<std::string> keys;
  py::object timeout;
  py::object discovery;
  std::string clock;
  bool shared_memory;
  LoopbackNetwork* network;
};

// The same parameters for both, as pybind11 needs them: the function's, their values and names.
#define TFDUDE_OPEN_PARAMETERS                                                         \
  std::optional<std::uint32_t> domain, std::optional<std::string> profile,             \
      std::optional<std::string> discovery_server, std::optional<std::string> keys,    \
      py::object timeout, py::object discovery, std::string clock, bool shared_memory, \
      LoopbackNetwork *network
#define TFDUDE_OPEN_VALUES \
  { domain, profile, discovery_server, keys, timeout, discovery, clock, shared_memory, network }
#define TFDUDE_OPEN_ARGUMENTS                                                                      \
  py::arg("domain") = py::none(), py::arg("profile") = py::none(),                                 \
  py::arg("discovery_server") = py::none(), py::arg("keys") = py::none(),                          \
  py::arg("timeout") = py::none(), py::arg("discovery") = py::none(), py::arg("clock") = "system", \
  py::arg("shared_memory") = true, py::arg("network") = py::none()

[[nodiscard]] Options to_options(const OpenArguments& arguments);

/// Lookups, by this library's names and tf2's.
void bind_lookups(py::module_& module, ClientClass& cls);
/// Many frames or instants in one call.
void bind_many(py::module_& module, ClientClass& cls);
/// Clouds of points, also for a Transform.
void bind_clouds(py::module_& module, ClientClass& cls, py::handle transform);
/// why().
void bind_explanations(py::module_& module, ClientClass& cls);
/// Values of many edges or joints, and streams.
void bind_values_of_many(py::module_& module, ClientClass& cls);
void bind_watches(py::module_& module, ClientClass& cls);
/// Changes of the structure, what asyncio needs, observations, the clock.
void bind_events(py::module_& module, ClientClass& cls);

}  // namespace tfdude::python
