#include <pybind11/stl.h>

#include "tfdude/transport/loopback.hpp"

#include "bind.hpp"
#include "client.hpp"

namespace tfdude::python {
namespace {

std::shared_ptr<NodeSession> open_node(const std::string& partition,
                                       const std::vector<FrameSpec>& frames,
                                       const std::string& state, bool sync,
                                       const OpenArguments& arguments) {
  check_usable();
  note_use();
  NodeOptions options = to_options(arguments);
  options.state = state;
  options.sync = sync;
  LoopbackNetwork* const network = arguments.network;
  auto node = without_gil([&] {
    return network != nullptr ? Node::open(network->join(), partition, frames, options)
                              : Node::open(partition, frames, options);
  });
  return std::make_shared<NodeSession>(std::make_shared<Node>(value_of(std::move(node))),
                                       options.timeout, partition);
}

}  // namespace

void bind_node(py::module_& module) {
  py::class_<NodeSession, Session, std::shared_ptr<NodeSession>>(
      module, "Node",
      "A process that owns a partition and serves its frames to others. Otherwise as Client.\n\n"
      "partition: its name; nobody else may serve it. frames: FrameSpec, in any order; parents\n"
      "may belong to others. state: directory in which the partition is stored; '': nothing is. "
      "sync:\n"
      "each change waits for the disk. The other parameters are those of Client, without follow.")
      .def(py::init([](const std::string& partition, const std::vector<FrameSpec>& frames,
                       const std::string& state, bool sync, TFDUDE_OPEN_PARAMETERS) {
             return open_node(partition, frames, state, sync, TFDUDE_OPEN_VALUES);
           }),
           py::arg("partition"), py::arg("frames") = std::vector<FrameSpec>{}, py::kw_only(),
           py::arg("state") = "", py::arg("sync") = false, TFDUDE_OPEN_ARGUMENTS)
      .def_property_readonly("partition", &Session::partition)
      .def_property_readonly(
          "own_frames",
          [](const NodeSession& session) {
            return session.call_node([](Node& node) { return node.own_frames(); });
          },
          "The number of frames of the partition.")
      .def(
          "clear_history",
          [](const NodeSession& session, const std::optional<std::string>& id) {
            if (!id) return session.call_node([](Node& node) { return node.clear_history(); });
            check(session.call_node([&](Node& node) { return node.clear_history(*id); }));
            return std::size_t{1};
          },
          py::arg("id") = py::none(),
          "Clears the history of a dynamic edge, or of all of the partition. Returns how many.");
}

}  // namespace tfdude::python
