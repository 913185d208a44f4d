#include "client.hpp"

#include <algorithm>
#include <chrono>
#include <map>

#include <pybind11/stl.h>

#include "tfdude/transport/loopback.hpp"

#include "arrays.hpp"
#include "bind.hpp"
#include "session.hpp"
#include "structure.hpp"
#include "waiting.hpp"

namespace tfdude::python {
namespace {

std::shared_ptr<Session> open_client(const OpenArguments& arguments,
                                     std::optional<std::vector<std::string>> follow) {
  check_usable();
  note_use();
  ClientOptions options = to_options(arguments);
  options.follow = std::move(follow);
  LoopbackNetwork* const network = arguments.network;
  auto client = without_gil([&] {
    return network != nullptr ? Client::open(network->join(), options) : Client::open(options);
  });
  return std::make_shared<Session>(std::make_shared<Client>(value_of(std::move(client))),
                                   options.timeout);
}

void bind_opening(py::class_<Session, std::shared_ptr<Session>>& cls) {
  cls.def(py::init([](std::optional<std::vector<std::string>> follow, TFDUDE_OPEN_PARAMETERS) {
            return open_client(TFDUDE_OPEN_VALUES, std::move(follow));
          }),
          py::kw_only(), py::arg("follow") = py::none(), TFDUDE_OPEN_ARGUMENTS);
  cls.def("close", &Session::close,
          "Leaves the domain. Afterwards each call raises TransformException.");
  cls.def_property_readonly("closed", &Session::closed);
  cls.def("__enter__", [](py::object self) { return self; });
  cls.def("__exit__", [](Session& session, const py::args&) { session.close(); });
}

void bind_writes(py::class_<Session, std::shared_ptr<Session>>& cls) {
  cls.def(
      "add",
      [](const Session& session, const std::string& id, const std::string& parent,
         const Transform& X_PC, const std::string& partition) {
        check(session.call([&](Client& c) { return c.add(id, parent, X_PC, partition); }));
      },
      py::arg("id"), py::arg("parent"), py::arg("X_PC"), py::arg("partition") = "",
      "Adds a frame; parent '' makes it a root. partition: its owner, if not the parent's.");
  cls.def(
      "remove",
      [](const Session& session, const std::string& id) {
        check(session.call([&](Client& c) { return c.remove(id); }));
      },
      py::arg("id"), "Removes a frame and all frames below it, whoever owns them.");
  cls.def(
      "forget",
      [](const Session& session, const std::string& partition) {
        check(session.call([&](Client& c) { return c.forget(partition); }));
      },
      py::arg("partition"), "Declares that an unreachable partition will not return.");
  cls.def(
      "move",
      [](const Session& session, const std::string& id, const std::string& parent,
         std::optional<Transform> X_PC) {
        const PartialTransform parts = X_PC ? PartialTransform(*X_PC) : PartialTransform();
        check(session.call([&](Client& c) { return c.move(id, parent, parts); }));
      },
      py::arg("id"), py::arg("parent"), py::arg("X_PC") = py::none(),
      "Moves a frame, with all below it, to a new parent. X_PC: None keeps its value.");
  cls.def(
      "hand_over",
      [](const Session& session, const std::string& id, const std::string& partition,
         const std::optional<std::string>& parent, std::optional<Transform> X_PC) {
        if (!parent && X_PC) throw py::value_error("X_PC needs a new parent");
        const PartialTransform parts = X_PC ? PartialTransform(*X_PC) : PartialTransform();
        check(session.call([&](Client& c) {
          return parent ? c.hand_over(id, partition, *parent, parts) : c.hand_over(id, partition);
        }));
      },
      py::arg("id"), py::arg("partition"), py::arg("parent") = py::none(),
      py::arg("X_PC") = py::none(),
      "Makes another partition the owner of a frame and of all below it that its owner has, with\n"
      "their histories and correlations. Readers find it all the time.\n\n"
      "parent: also moves it below that frame, in the same step; X_PC is as of move().");
  cls.def(
      "update",
      [](const Session& session, const std::string& id, const Transform& X_PC, py::handle stamp) {
        const std::optional<Time> time = to_stamp(stamp, "stamp");
        check(session.call([&](Client& c) { return c.update(id, X_PC, time); }));
      },
      py::arg("id"), py::arg("X_PC"), py::arg("stamp") = py::none(),
      "Sets the value of the edge from a frame's parent to the frame; the owner acknowledges it.\n"
      "With a stamp the value is a sample.");
}

Loading to_loading(py::handle values) {
  const py::array any = py::array::ensure(values);
  PyErr_Clear();
  if (any && any.ndim() == 1) return to_twist(values, "sources");
  const Doubles array = doubles(values, {6, -1}, "sources");
  using Rows = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const Rows>(array.data(), 6, array.shape(1));
}

void bind_parts(py::class_<Session, std::shared_ptr<Session>>& cls) {
  cls.def(
      "update_parts",
      [](const Session& session, const std::string& id, py::handle translation,
         py::handle quaternion, py::handle covariance, py::handle stamp) {
        PartialUpdate update{id};
        if (!translation.is_none()) {
          update.X_PC.translation = to_vector3(translation, "translation");
        }
        if (!quaternion.is_none()) update.X_PC.rotation = to_quaternion(quaternion, "quaternion");
        if (!covariance.is_none()) update.X_PC.covariance = to_covariance(covariance);
        const std::optional<Time> time = to_stamp(stamp, "stamp");
        check(session.call([&](Client& c) { return c.update_partial({update}, time); }));
      },
      py::arg("id"), py::kw_only(), py::arg("translation") = py::none(),
      py::arg("quaternion") = py::none(), py::arg("covariance") = py::none(),
      py::arg("stamp") = py::none(),
      "Sets parts of an edge; the owner keeps the others. covariance: 'unspecified', 'exact',\n"
      "(6, 6) or (21,).");
  cls.def(
      "correlate",
      [](const Session& session, const std::string& id,
         const std::map<std::string, py::object>& sources, bool unknown) {
        Correlation correlation;
        correlation.unknown = unknown;
        for (const auto& [source, loading] : sources) {
          correlation.common_errors.push_back({source, false, to_loading(loading)});
        }
        check(session.call([&](Client& c) { return c.correlate(id, correlation); }));
      },
      py::arg("id"), py::arg("sources") = py::dict(), py::kw_only(), py::arg("unknown") = false,
      "Sets how the error of an edge is correlated with those of others. sources: for each name\n"
      "the edge's error for one standard deviation of the source, (6,) or (6, k); edges that name\n"
      "the same source share it. unknown: its own part may be correlated with anything. Without\n"
      "arguments the edge is independent.");
}

void bind_structure(py::class_<Session, std::shared_ptr<Session>>& cls) {
  bind_structure_of(cls);
  cls.def(
      "find_memory",
      [](const Session& session) {
        (void)session.call([](Client& c) {
          c.find_memory();
          return true;
        });
      },
      "Asks all owners on this computer where their memory is, so that also the first lookups of\n"
      "their frames read it. Otherwise this is done in the background after the first lookup.");
  cls.def(
      "exists",
      [](const Session& session, const std::string& id) {
        return value_of(session.call([&](Client& c) { return c.whether_exists(id); }));
      },
      py::arg("id"),
      "Whether a frame with this id exists. Raises TimeoutException or UnreachableException if\n"
      "nobody can say.");
  cls.def(
      "now",
      [](const Session& session) {
        return from_stamp(value_of(session.call([](Client& c) { return c.now(); })));
      },
      "The time of this client's clock [ns].");
  cls.def(
      "wait_until",
      [](const Session& session, py::handle time, py::handle timeout) {
        const Time until = to_time(time, "time");
        const auto is_timeout = [](const Error& error) { return error.code == Errc::kTimeout; };
        check(value_after_wait(
            session, to_milliseconds(timeout, "timeout"),
            [&](Client& c, Milliseconds wait) { return c.wait_until(until, wait); }, is_timeout));
      },
      py::arg("time"), py::arg("timeout"),
      "Waits until this client's clock has reached a time. Raises TimeoutException after timeout\n"
      "[s].");
}

}  // namespace

Options to_options(const OpenArguments& arguments) {
  Options options;
  if (arguments.domain) options.domain = *arguments.domain;
  if (arguments.profile) options.profile = *arguments.profile;
  if (arguments.discovery_server) options.discovery_server = *arguments.discovery_server;
  if (arguments.keys) options.keys = *arguments.keys;
  if (!arguments.timeout.is_none()) {
    options.timeout = not_negative(to_milliseconds(arguments.timeout, "timeout"), "timeout");
  }
  if (!arguments.discovery.is_none()) {
    options.discovery =
        not_negative(to_milliseconds(arguments.discovery, "discovery"), "discovery");
  }
  // The environment may have switched it off.
  options.shared_memory = options.shared_memory && arguments.shared_memory;
  if (arguments.clock == "external") {
    options.clock = ClockKind::kExternal;
  } else if (arguments.clock != "system") {
    throw py::value_error("clock must be 'system' or 'external', not '" + arguments.clock + "'");
  }
  return options;
}

void bind_client(py::module_& module) {
  py::class_<LoopbackNetwork>(
      module, "LoopbackNetwork",
      "A network inside this process, for tests: Client(network=...) instead of DDS.")
      .def(py::init<>());
  py::class_<Session, std::shared_ptr<Session>> cls(
      module, "Client",
      "Access to all frames of a domain. See Node for a process that owns frames.\n\n"
      "domain: DDS domain (default: the environment's TFDUDE_DOMAIN, else 0). profile: XML file\n"
      "of DDS profiles, or 'local' for this computer only. keys: directory of an identity. "
      "timeout\n"
      "[s]: of each call. discovery [s]: how long a new participant searches for others. follow:\n"
      "frames to follow instead of all. clock: 'system' or 'external'. shared_memory: whether "
      "lookups\n"
      "read the memory of other processes, and others that of this one. network: a "
      "LoopbackNetwork\n"
      "instead of DDS.\n\n"
      "All calls may be used from any thread; they release the GIL while they wait. Instants are\n"
      "int [ns], float [s] or datetime with a time zone; durations are numbers [s] or timedelta.\n"
      "Each call may raise TransformException; its subclasses say why.");
  bind_opening(cls);
  bind_writes(cls);
  bind_parts(cls);
  bind_structure(cls);
  bind_lookups(module, cls);
  bind_many(module, cls);
  bind_clouds(module, cls, module.attr("Transform"));
  bind_explanations(module, cls);
  bind_values_of_many(module, cls);
  bind_watches(module, cls);
  bind_events(module, cls);
}

}  // namespace tfdude::python
