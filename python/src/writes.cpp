#include <algorithm>
#include <optional>

#include <pybind11/stl.h>

#include "tfdude/client/broadcast.hpp"

#include "arrays.hpp"
#include "batches.hpp"
#include "bind.hpp"
#include "client.hpp"
#include "many.hpp"
#include "waiting.hpp"

// Values of many edges or joints: in one call, and by streams that are opened once.
namespace tfdude::python {
namespace {

using Names = std::vector<std::string>;

std::vector<EdgeUpdate> edges_of(const Names& ids, py::handle poses, py::handle covariances) {
  std::vector<Transform> X = to_transforms(poses, covariances, ids.size());
  std::vector<EdgeUpdate> edges;
  edges.reserve(ids.size());
  for (std::size_t i = 0; i < ids.size(); ++i) edges.push_back({ids[i], X[i]});
  return edges;
}

/// One number for each of `count`; none for None.
std::vector<double> numbers(py::handle values, std::size_t count, const char* what) {
  if (values.is_none()) return {};
  const Doubles array = doubles(values, {static_cast<py::ssize_t>(count)}, what);
  return {array.data(), array.data() + count};
}

/// One for each of `count`, or None for it: unspecified.
std::vector<std::optional<double>> variances_of(py::handle values, std::size_t count) {
  std::vector<std::optional<double>> variances;
  const bool named = py::isinstance<py::sequence>(values) && !py::isinstance<py::str>(values);
  bool lacks = false;
  if (named && !py::isinstance<py::array>(values)) {
    for (const py::handle one : py::reinterpret_borrow<py::sequence>(values)) {
      lacks = lacks || one.is_none();
    }
  }
  if (!lacks) {
    for (const double one : numbers(values, count, "variances")) variances.emplace_back(one);
    return variances;
  }
  for (const py::handle one : py::reinterpret_borrow<py::sequence>(values)) {
    variances.push_back(one.is_none() ? std::nullopt
                                      : std::optional(*doubles(one, {}, "variances").data()));
  }
  if (variances.size() != count) {
    throw py::value_error("variances must have the shape (" + std::to_string(count) + ",), not (" +
                          std::to_string(variances.size()) + ",)");
  }
  return variances;
}

std::vector<JointValue> joints_of(const Names& names, py::handle positions, py::handle variances) {
  const std::vector<double> position = numbers(positions, names.size(), "positions");
  const auto variance = variances_of(variances, names.size());
  if (position.empty() && !names.empty()) throw py::type_error("positions must be numbers");
  std::vector<JointValue> joints;
  joints.reserve(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    joints.push_back({names[i], position[i]});
    if (!variance.empty()) joints.back().variance = variance[i];
  }
  return joints;
}

py::list not_sent(const std::vector<NotSent>& all, const Names& names) {
  py::list list;
  for (const NotSent& one : all) {
    list.append(py::make_tuple(names[one.index], std::string(to_string(one.why)),
                               std::string(one.partition)));
  }
  return list;
}

/// A stream of the library, with the names that it was opened with. One thread at a time: the GIL
/// is kept, as it never waits.
template <class Stream>
struct Streaming {
  Names names;
  Stream stream;
};
using StreamedEdges = Streaming<EdgeStream>;
using Joints = Streaming<JointStream>;

py::list publish_edges(StreamedEdges& edges, py::handle poses, py::handle covariances,
                       py::handle stamp) {
  check_usable();
  const std::vector<Transform> X = to_transforms(poses, covariances, edges.names.size());
  return not_sent(edges.stream.try_publish(X, to_stamp(stamp, "stamp")), edges.names);
}

py::list publish_joints(Joints& joints, py::handle positions, py::handle variances,
                        py::handle stamp) {
  check_usable();
  const std::size_t count = joints.names.size();
  if (positions.is_none()) throw py::type_error("positions must be numbers");
  return not_sent(
      joints.stream.try_publish(numbers(positions, count, "positions"),
                                numbers(variances, count, "variances"), to_stamp(stamp, "stamp")),
      joints.names);
}

void bind_streams(py::module_& module, ClientClass& cls) {
  constexpr const char* kReturns =
      "Never waits. Returns what was not sent, as (name, code, partition); empty: everything was\n"
      "handed to the transport.";
  py::class_<StreamedEdges>(
      module, "EdgeStream",
      "Streams edge values without acknowledgement. For one thread at a time.")
      .def("publish", &publish_edges, py::arg("poses"), py::arg("covariances") = py::none(),
           py::arg("stamp") = py::none(), kReturns);
  py::class_<Joints>(module, "JointStream",
                     "Streams joint positions without acknowledgement. For one thread at a time.")
      .def("publish", &publish_joints, py::arg("positions"), py::arg("variances") = py::none(),
           py::arg("stamp") = py::none(), kReturns);
  cls.def(
      "stream",
      [](const Session& session, const Names& ids) {
        auto stream = session.call([&](Client& c) { return c.stream(ids); });
        return std::make_unique<StreamedEdges>(StreamedEdges{ids, value_of(std::move(stream))});
      },
      py::arg("ids"), "Opens a stream of edges, for loops of 1 kHz and more.");
  cls.def(
      "stream_joints",
      [](const Session& session, const Names& names) {
        auto stream = session.call([&](Client& c) { return c.stream_joints(names); });
        return std::make_unique<Joints>(Joints{names, value_of(std::move(stream))});
      },
      py::arg("names"), "Opens a stream of joints, for loops of 1 kHz and more.");
}

void bind_many(ClientClass& cls) {
  cls.def(
      "update_many",
      [](const Session& session, const Names& ids, py::handle poses, py::handle covariances,
         py::handle stamp) {
        const std::vector<EdgeUpdate> edges = edges_of(ids, poses, covariances);
        const std::optional<Time> time = to_stamp(stamp, "stamp");
        check(session.call([&](Client& c) { return c.update(edges, time); }));
      },
      py::arg("ids"), py::arg("poses"), py::arg("covariances") = py::none(),
      py::arg("stamp") = py::none(),
      "Updates many edges; each owner applies its share as one commit, and acknowledges it.\n\n"
      "poses: (N, 7), each translation and quaternion (x, y, z, w); or N Transforms.\n"
      "covariances: None, 'exact', one (6, 6) for all, or (N, 6, 6).");
  cls.def(
      "publish",
      [](const Session& session, const Names& ids, py::handle poses, py::handle covariances,
         py::handle stamp) {
        const std::vector<EdgeUpdate> edges = edges_of(ids, poses, covariances);
        if (!is_many(stamp)) {
          const std::optional<Time> time = to_stamp(stamp, "stamp");
          return check(session.call([&](Client& c) { return c.publish(edges, time); }));
        }
        const std::vector<Time> stamps = to_instants(stamp, "stamp");
        check(session.call([&](Client& c) { return tfdude::publish(c, edges, stamps); }));
      },
      py::arg("ids"), py::arg("poses"), py::arg("covariances") = py::none(),
      py::arg("stamp") = py::none(),
      "As update_many(), without acknowledgement.\n\n"
      "stamp: of all, or one for each; those of one stamp are one commit of each owner.");
}

/// The interval of a rewrite: (first, last), or that of the samples.
TimeInterval interval_of(py::handle interval, const std::vector<Time>& stamps) {
  if (interval.is_none()) {
    // Also of those that are not in order, so that the error says that.
    const auto [first, last] = std::minmax_element(stamps.begin(), stamps.end());
    return {*first, *last};
  }
  const bool pair = py::isinstance<py::sequence>(interval) && py::len(interval) == 2;
  if (!pair) throw py::type_error("interval must be None, or its first and last instant");
  const auto ends = py::reinterpret_borrow<py::sequence>(interval);
  return {to_time(ends[0], "interval[0]"), to_time(ends[1], "interval[1]")};
}

void bind_rewrite(ClientClass& cls) {
  cls.def(
      "rewrite",
      [](const Session& session, const std::string& id, py::handle stamps, py::handle poses,
         py::handle covariances, py::handle interval) {
        const std::vector<Time> times = to_instants(stamps, "stamps");
        if (times.empty()) throw py::value_error("stamps must have at least one instant");
        const std::vector<Transform> X = to_transforms(poses, covariances, times.size());
        std::vector<EdgeSample> samples(times.size());
        for (std::size_t i = 0; i < times.size(); ++i) samples[i] = {times[i], X[i]};
        const TimeInterval within = interval_of(interval, times);
        check(session.call([&](Client& c) { return c.rewrite(id, within, samples); }));
      },
      py::arg("id"), py::arg("stamps"), py::arg("poses"), py::arg("covariances") = py::none(),
      py::arg("interval") = py::none(),
      "Replaces the samples of a dynamic edge within an interval, as SLAM does after a loop was\n"
      "closed: one commit of its owner. Lookups, watches and recordings have the history before "
      "it,\n"
      "or the one after it.\n\n"
      "stamps: (N,), in ascending order: int64 [ns], float64 [s], datetime64, or a sequence.\n"
      "poses: (N, 7), each translation and quaternion (x, y, z, w); or N Transforms.\n"
      "covariances: None, 'exact', one (6, 6) for all, or (N, 6, 6).\n"
      "interval: its first and last instant; None: those of the stamps.");
}

void bind_joints(ClientClass& cls) {
  cls.def(
      "publish_joints",
      [](const Session& session, const Names& names, py::handle positions, py::handle variances,
         py::handle stamp) {
        std::vector<JointValue> joints = joints_of(names, positions, variances);
        const std::optional<Time> time = to_stamp(stamp, "stamp");
        check(session.call([&](Client& c) { return c.publish_joints(std::move(joints), time); }));
      },
      py::arg("names"), py::arg("positions"), py::arg("variances") = py::none(),
      py::arg("stamp") = py::none(),
      "Streams joint positions (N,) [rad or m] to their owners, without acknowledgement.\n\n"
      "variances: (N,) [rad² or m²]; None for all, or for one in a list: unspecified. Repeated\n"
      "calls for the same joints are cheaper by stream_joints().");
  cls.def(
      "update_joints",
      [](const Session& session, const Names& names, py::handle positions, py::handle variances,
         py::handle stamp) {
        std::vector<JointValue> joints = joints_of(names, positions, variances);
        const std::optional<Time> time = to_stamp(stamp, "stamp");
        check(session.call([&](Client& c) { return c.update_joints(std::move(joints), time); }));
      },
      py::arg("names"), py::arg("positions"), py::arg("variances") = py::none(),
      py::arg("stamp") = py::none(), "As publish_joints(), acknowledged by the owners.");
  cls.def(
      "joints",
      [](const Session& session, const std::string& partition, py::handle timeout) {
        return after_wait(session, timeout,
                          [&](Client& c, Milliseconds wait) { return c.joints(partition, wait); });
      },
      py::arg("partition"), py::kw_only(), py::arg("timeout") = 0.0,
      "The joints of a partition and their positions, sorted by name. timeout [s]: how long to\n"
      "wait for the partition.");
  cls.def(
      "flush",
      [](const Session& session, py::handle timeout) {
        const Milliseconds wait = to_milliseconds(timeout, "timeout");
        check(session.call([&](Client& c) { return c.flush(wait); }));
      },
      py::arg("timeout") = 1.0,
      "Waits until everything that this client has streamed has reached the owners.");
}

}  // namespace

void bind_values_of_many(py::module_& module, ClientClass& cls) {
  bind_many(cls);
  bind_rewrite(cls);
  bind_joints(cls);
  bind_streams(module, cls);
}

}  // namespace tfdude::python
