#include <pybind11/stl.h>

#include "tfdude/types/change.hpp"
#include "tfdude/types/edge.hpp"
#include "tfdude/types/frame.hpp"
#include "tfdude/types/joint_spec.hpp"
#include "tfdude/types/not_sent.hpp"
#include "tfdude/types/partition_info.hpp"
#include "tfdude/types/query.hpp"

#include "arrays.hpp"
#include "bind.hpp"

namespace tfdude::python {
namespace {

py::object clock_name(std::optional<ClockKind> clock) {
  if (!clock) return py::none();
  return py::str(to_string(*clock));
}

void bind_stamped(py::module_& module) {
  py::class_<StampedTransform, Transform>(
      module, "StampedTransform",
      "A transform and its instant: the answer to a lookup. Without a stamp it holds for all\n"
      "times, since all edges of the path are static.")
      .def_property_readonly(
          "stamp", [](const StampedTransform& X) { return from_stamp(X.stamp); },
          "The instant [ns], or None.")
      .def_property_readonly(
          "datetime", [](const StampedTransform& X) { return to_datetime(X.stamp); },
          "The instant in UTC, to microseconds; or None.")
      .def_property_readonly(
          "unspecified", [](const StampedTransform& X) { return X.basis.unspecified; },
          "The child frames of the path's edges whose covariance is unspecified.")
      .def_property_readonly(
          "sources", [](const StampedTransform& X) { return X.basis.sources; },
          "Error sources that edges of the path share.")
      .def_property_readonly(
          "bound", [](const StampedTransform& X) { return X.basis.bound; },
          "Whether the covariance is an upper bound, because a correlation is unknown.")
      .def_property_readonly(
          "lost",
          [](const StampedTransform& X) {
            std::vector<std::pair<std::string, double>> lost;
            for (const LostOwner& one : X.basis.lost) {
              lost.emplace_back(one.partition, std::chrono::duration<double>(one.ago).count());
            }
            return lost;
          },
          "The owners that are gone, and since when [s]: see lookup(last_known=True).");
}

void bind_velocity(py::module_& module) {
  py::class_<Velocity>(module, "Velocity",
                       "The mean velocity of a frame in another, in the axes of that other.")
      .def_property_readonly(
          "linear", [](const Velocity& v) { return from_vector3(v.linear); }, "(3,) [m/s]")
      .def_property_readonly(
          "angular", [](const Velocity& v) { return from_vector3(v.angular); }, "(3,) [rad/s]")
      .def_property_readonly(
          "complete", [](const Velocity& v) { return v.covariance.complete(); },
          "Whether the covariance of each edge is specified.")
      .def_property_readonly(
          "covariance",
          [](const Velocity& v) {
            if (!v.covariance.complete()) {
              raise_unspecified("the covariance of the velocity is not complete");
            }
            return from_matrix6(v.covariance.of_specified().matrix());
          },
          "Covariance (6, 6) of (linear, angular). Raises UnspecifiedCovariance.")
      .def_property_readonly(
          "covariance_of_specified",
          [](const Velocity& v) { return from_matrix6(v.covariance.of_specified().matrix()); },
          "That of those edges that have one, (6, 6).")
      .def_property_readonly(
          "begin", [](const Velocity& v) { return from_stamp(v.begin); }, "[ns], or None")
      .def_property_readonly(
          "end", [](const Velocity& v) { return from_stamp(v.end); }, "[ns], or None");
}

void bind_structure(py::module_& module) {
  py::class_<Frame>(module, "Frame", "A frame and its place in the structure.")
      .def_readonly("id", &Frame::id)
      .def_readonly("parent", &Frame::parent, "Empty: a root.")
      .def_readonly("partition", &Frame::partition, "Its owner.")
      .def_readonly("attached", &Frame::attached, "Whether its parent exists.");
  py::class_<PathSegment>(module, "PathSegment", "One partition's share of a path.")
      .def_readonly("partition", &PathSegment::partition)
      .def_readonly("start", &PathSegment::from)
      .def_readonly("end", &PathSegment::to);
  py::class_<PartitionInfo>(module, "PartitionInfo", "What is known of a partition.")
      .def_readonly("name", &PartitionInfo::name)
      .def_readonly("host", &PartitionInfo::host)
      .def_readonly("pid", &PartitionInfo::pid)
      .def_readonly("frames", &PartitionInfo::frames, "The number of its frames.")
      .def_readonly("reachable", &PartitionInfo::reachable)
      .def_property_readonly(
          "since", [](const PartitionInfo& info) { return from_stamp(info.since); },
          "When `reachable` last changed [ns].")
      .def_readonly("stopped", &PartitionInfo::stopped, "If not reachable: it said that it stops.")
      .def_readonly("silent", &PartitionInfo::silent,
                    "If not reachable: others have not said yet if it was stopped or is lost.")
      .def_readonly("program", &PartitionInfo::program, "The version of its program.")
      .def_property_readonly("compatible", &PartitionInfo::compatible)
      .def_property_readonly(
          "clock", [](const PartitionInfo& info) { return clock_name(info.clock); },
          "'system', 'external' or None.")
      .def_readonly("in_memory", &PartitionInfo::in_memory, "Whether lookups read its memory.")
      .def_readonly("why_not_in_memory", &PartitionInfo::why_not_in_memory,
                    "Why they ask it over DDS; empty: they do not.")
      .def_readonly(
          "complete", &PartitionInfo::complete,
          "All frames that it has announced have come here. If it is not reachable, it was\n"
          "lost after that.");
  py::class_<Change>(module, "Change", "A change of the structure.")
      .def_property_readonly(
          "kind", [](const Change& change) { return std::string(to_string(change.kind)); },
          "'partition_up', 'partition_down', 'frame_added', 'frame_removed', 'frame_moved',\n"
          "'conflict', 'joint_conflict', 'history_restarted', 'frame_orphaned', 'frame_taken_over' "
          "or\n"
          "'missed'.")
      .def_readonly("partition", &Change::partition)
      .def_readonly("frame", &Change::frame, "Empty if it concerns a partition.")
      .def_readonly("parent", &Change::parent)
      .def_readonly("rival", &Change::rival)
      .def_readonly("joint", &Change::joint, "Of a conflict of joints.")
      .def_readonly("message", &Change::message, "For people.")
      .def_property_readonly(
          "stamp", [](const Change& change) { return from_stamp(change.time); }, "[ns]")
      .def_readonly("stopped", &Change::stopped)
      .def("__repr__", [](const Change& change) {
        return "<Change " + std::string(to_string(change.kind)) + ": " + change.message + ">";
      });
}

void bind_statistics(py::module_& module) {
  py::class_<HistoryInfo>(module, "HistoryInfo", "Statistics of one edge's history.")
      .def_readonly("id", &HistoryInfo::id)
      .def_readonly("samples", &HistoryInfo::samples)
      .def_readonly("bytes", &HistoryInfo::bytes)
      .def_property_readonly(
          "oldest", [](const HistoryInfo& info) { return from_stamp(info.oldest); }, "[ns]")
      .def_property_readonly(
          "newest", [](const HistoryInfo& info) { return from_stamp(info.newest); }, "[ns]")
      .def_property_readonly(
          "mean_gap", [](const HistoryInfo& info) { return to_seconds(info.mean_gap); }, "[s]")
      .def_property_readonly(
          "max_gap", [](const HistoryInfo& info) { return to_seconds(info.max_gap); }, "[s]")
      .def_property_readonly(
          "jitter", [](const HistoryInfo& info) { return to_seconds(info.jitter); }, "[s]")
      .def_readonly("refused_old", &HistoryInfo::refused_old)
      .def_readonly("refused_equal", &HistoryInfo::refused_equal)
      .def_readonly("refused_ahead", &HistoryInfo::refused_ahead);
  py::class_<EdgeConsistency>(module, "EdgeConsistency",
                              "What observations show about one edge's covariance: it is right if\n"
                              "`squares` is near `expected`, and too small if it is greater.")
      .def_readonly("id", &EdgeConsistency::id)
      .def_readonly("observations", &EdgeConsistency::observations)
      .def_readonly("refused", &EdgeConsistency::refused)
      .def_property_readonly("squares", [](const EdgeConsistency& e) { return e.sum.squares; })
      .def_property_readonly("expected", [](const EdgeConsistency& e) { return e.sum.expected; })
      .def_property_readonly("variance", [](const EdgeConsistency& e) { return e.sum.variance; });
  py::class_<Observed>(module, "Observed", "The result of a measurement.")
      .def_readonly("accepted", &Observed::accepted, "False: it changed nothing.")
      .def_readonly("distance_squared", &Observed::distance_squared,
                    "Squared Mahalanobis distance from the estimate.")
      .def_readonly("dimensions", &Observed::dimensions, "Of that distance.")
      .def_readonly("limit", &Observed::limit, "Of the gate.")
      .def_readonly("corrected", &Observed::corrected, "The edges whose values changed.")
      .def_readonly("forgotten", &Observed::forgotten,
                    "Edges that were correlated with the path's, and are not any more.")
      .def_property_readonly(
          "stamp", [](const Observed& observed) { return from_stamp(observed.stamp); },
          "Of the corrected dynamic edges [ns], or None.");
}

void bind_joints(py::module_& module) {
  py::class_<JointInfo>(module, "JointInfo", "A joint and its state.")
      .def_readonly("name", &JointInfo::name)
      .def_readonly("frame", &JointInfo::frame, "The frame that it moves.")
      .def_property_readonly(
          "type", [](const JointInfo& joint) { return to_string(joint.type); },
          "'revolute', 'continuous' or 'prismatic'.")
      .def_property_readonly(
          "limits",
          [](const JointInfo& joint) -> py::object {
            if (!joint.limits) return py::none();
            return py::make_tuple(joint.limits->lower, joint.limits->upper);
          },
          "(lower, upper) [rad or m], or None.")
      .def_property_readonly(
          "mimics",
          [](const JointInfo& joint) -> py::object {
            if (!joint.mimic) return py::none();
            return py::str(joint.mimic->joint);
          },
          "The joint that it follows, or None.")
      .def_readonly("position", &JointInfo::position, "[rad or m]")
      .def_readonly("variance", &JointInfo::variance, "[rad² or m²]; None: unspecified.")
      .def_readonly("measured", &JointInfo::measured, "False: the position is assumed.")
      .def_readonly("outside", &JointInfo::outside, "Applied positions outside the limits.")
      .def_readonly("refused", &JointInfo::refused, "Rejected positions outside the limits.");
}

}  // namespace

void bind_values(py::module_& module) {
  bind_stamped(module);
  bind_velocity(module);
  bind_structure(module);
  bind_statistics(module);
  bind_joints(module);
}

}  // namespace tfdude::python
