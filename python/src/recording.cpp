#include "tfdude/recording/recording.hpp"

#include <mutex>

#include <pybind11/stl.h>

#include "bind.hpp"
#include "many.hpp"
#include "session.hpp"
#include "structure.hpp"

namespace tfdude::python {
namespace {

/// A recording for any thread: it is read without the GIL, by one thread at a time.
class SharedRecording {
 public:
  explicit SharedRecording(Recording recording) : recording_(std::move(recording)) {}

  template <class Function>
  auto call(const Function& function) {
    return without_gil([&] {
      const std::lock_guard<std::mutex> lock(mutex_);
      return function(recording_);
    });
  }

 private:
  std::mutex mutex_;
  Recording recording_;
};
using RecordingClass = py::class_<SharedRecording>;

std::vector<Change> events_of(SharedRecording& shared, std::optional<Time> from) {
  return shared.call([&](Recording& recording) {
    std::vector<Change> changes;
    recording.events(from.value_or(Time{}), [&](const Change& change) {
      changes.push_back(change);
      return true;
    });
    return changes;
  });
}

void bind_questions(RecordingClass& cls) {
  cls.def(
      "lookup",
      [](SharedRecording& shared, const std::string& a, const std::string& b, py::handle at,
         py::handle extrapolate, py::handle age_noise_until, int order, py::handle believed_at) {
        const Query query = to_query(at, extrapolate, age_noise_until, order, believed_at);
        return value_of(
            shared.call([&](Recording& recording) { return recording.lookup(a, b, query); }));
      },
      py::arg("a"), py::arg("b"), py::arg("at") = py::none(), py::kw_only(),
      py::arg("extrapolate") = 0.0, py::arg("age_noise_until") = py::none(), py::arg("order") = 2,
      py::arg("believed_at") = py::none(),
      "X_AB as Client.lookup() answered at the instant that is shown. Raises as it does.\n"
      "believed_at: goes to that instant first.");
  cls.def(
      "lookup_at",
      [](SharedRecording& shared, const std::string& a, const std::string& b, py::handle at,
         py::handle timeout) {
        const Time time = to_time(at, "at");
        const Milliseconds wait = to_milliseconds(timeout, "timeout");
        return value_of(shared.call(
            [&](Recording& recording) { return recording.lookup_at(a, b, time, {}, wait); }));
      },
      py::arg("a"), py::arg("b"), py::arg("at"), py::kw_only(), py::arg("timeout") = 10.0,
      "X_AB at a stamp, as Client.lookup() answered that was asked at that instant and waited:\n"
      "goes there, and on until all edges have their data. timeout: of the recording's time [s].");
  cls.def(
      "trajectory",
      [](SharedRecording& shared, const std::string& a, const std::string& b, py::handle instants,
         py::handle timeout, int order) {
        std::vector<Time> times = to_instants(instants, "instants");
        const Milliseconds wait = to_milliseconds(timeout, "timeout");
        Query query;
        query.order = to_order(order);
        auto found = shared.call(
            [&](Recording& recording) { return recording.trajectory(a, b, times, query, wait); });
        return trajectory_object(std::move(found), std::move(times));
      },
      py::arg("a"), py::arg("b"), py::arg("instants"), py::kw_only(), py::arg("timeout") = 10.0,
      py::arg("order") = 2,
      "X_AB at many instants, in any order: a Trajectory, with arrays (N, 7) and (N, 6, 6). Each\n"
      "as lookup_at() answers it, but the file is read once.");
  cls.def(
      "lookup_full",
      [](SharedRecording& shared, const std::string& a, py::handle at_a, const std::string& b,
         py::handle at_b, const std::string& fixed) {
        const Time time_a = to_time(at_a, "at_a");
        const Time time_b = to_time(at_b, "at_b");
        return value_of(shared.call([&](Recording& recording) {
          return recording.lookup_at(a, time_a, b, time_b, fixed);
        }));
      },
      py::arg("a"), py::arg("at_a"), py::arg("b"), py::arg("at_b"), py::arg("fixed"),
      "As Client.lookup_full().");
  cls.def(
      "joints",
      [](SharedRecording& shared, const std::string& partition) {
        return value_of(
            shared.call([&](Recording& recording) { return recording.joints(partition); }));
      },
      py::arg("partition"), "The joints of a partition; they are recorded once a second.");
  cls.def(
      "history",
      [](SharedRecording& shared, const std::string& id) {
        return value_of(shared.call([&](Recording& recording) { return recording.history(id); }));
      },
      py::arg("id"), "Of an edge in the whole recording; reads the whole file.");
  cls.def(
      "events",
      [](SharedRecording& shared, py::handle start) {
        return events_of(shared, to_stamp(start, "start"));
      },
      py::arg("start") = py::none(), "All recorded changes from an instant on; reads the file.");
}

void bind_instant(RecordingClass& cls) {
  cls.def(
      "seek",
      [](SharedRecording& shared, py::handle at) {
        const Time time = to_time(at, "at");
        shared.call([&](Recording& recording) {
          recording.seek(time);
          return true;
        });
      },
      py::arg("at"), "Goes to an instant.");
  cls.def(
      "step",
      [](SharedRecording& shared) {
        return shared.call([](Recording& recording) { return recording.step(); });
      },
      "Goes to the next message. Returns whether there is one.");
  cls.def_property_readonly(
      "instant",
      [](SharedRecording& shared) {
        return from_stamp(shared.call([](Recording& recording) { return recording.instant(); }));
      },
      "The instant that is shown [ns]; at first the end.");
  cls.def_property_readonly(
      "summary",
      [](SharedRecording& shared) {
        return shared.call([](Recording& recording) { return recording.summary(); });
      },
      "What the recording contains, and what is wrong with it.");
  cls.def(
      "read_all",
      [](SharedRecording& shared) {
        shared.call([](Recording& recording) { recording.read_all(); });
      },
      "Reads the whole file, so that the summary knows all that is wrong with it.");
}

}  // namespace

void bind_recording(py::module_& module) {
  py::class_<RecordingSummary>(module, "RecordingSummary", "What a recording contains.")
      .def_readonly("library", &RecordingSummary::library, "That wrote the file.")
      .def_readonly("foreign", &RecordingSummary::foreign, "Transforms of ROS only.")
      .def_readonly("finished", &RecordingSummary::finished, "False: it was interrupted.")
      .def_property_readonly(
          "start", [](const RecordingSummary& summary) { return from_stamp(summary.start); },
          "[ns], or None")
      .def_property_readonly(
          "end", [](const RecordingSummary& summary) { return from_stamp(summary.end); },
          "[ns], or None")
      .def_readonly("bytes", &RecordingSummary::bytes)
      .def_readonly("chunks", &RecordingSummary::chunks)
      .def_readonly("messages", &RecordingSummary::messages, "None: not known without reading.")
      .def_readonly("problems", &RecordingSummary::problems, "What is wrong with the file.")
      .def_readonly("left_out", &RecordingSummary::left_out,
                    "Transforms of ROS that were left out; None: call read_all() to know.")
      .def_property_readonly(
          "transforms",
          [](const RecordingSummary& summary) -> std::optional<std::map<std::string, std::size_t>> {
            const auto& counts = summary.transforms;
            if (!counts) return std::nullopt;
            return std::map<std::string, std::size_t>{
                {"messages", counts->messages},   {"names", counts->names},
                {"values", counts->values},       {"cycles", counts->cycles},
                {"repeated", counts->repeated},   {"old", counts->old},
                {"early", counts->early},         {"same", counts->same},
                {"unstamped", counts->unstamped}, {"jumps", counts->jumps}};
          },
          "How many transforms of ROS were left out, or taken otherwise, by kind; None: as\n"
          "`left_out`. docs/recording.md has the kinds.");
  RecordingClass cls(
      module, "Recording",
      "A file of `tfdude record`, or an MCAP file with transforms of ROS, which is asked as a\n"
      "Client, without a network. It shows one instant, at first its end. For any thread.");
  cls.def(py::init([](const std::string& file) {
            auto recording = without_gil([&] { return Recording::open(file); });
            return std::make_unique<SharedRecording>(value_of(std::move(recording)));
          }),
          py::arg("file"));
  bind_instant(cls);
  bind_questions(cls);
  bind_structure_of(cls);
}

}  // namespace tfdude::python
