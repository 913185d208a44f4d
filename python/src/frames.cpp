#include <pybind11/stl.h>

#include "tfdude/description/config.hpp"
#include "tfdude/description/frame_file.hpp"
#include "tfdude/description/urdf.hpp"
#include "tfdude/types/frame.hpp"

#include "arrays.hpp"
#include "bind.hpp"
#include "waiting.hpp"

namespace tfdude::python {
namespace {

JointType type_named(const std::string& name) {
  for (const JointType type :
       {JointType::kRevolute, JointType::kContinuous, JointType::kPrismatic}) {
    if (name == to_string(type)) return type;
  }
  throw py::value_error("type must be 'revolute', 'continuous' or 'prismatic', not '" + name + "'");
}

JointSpec make_joint(std::string name, const std::string& type, py::handle axis,
                     std::optional<std::pair<double, double>> limits, double position,
                     std::optional<double> variance, bool strict) {
  JointSpec joint;
  joint.name = std::move(name);
  joint.type = type_named(type);
  // The origin is the frame's transform, and is set by make_frame().
  const Eigen::Vector3d unit = to_vector3(axis, "axis").normalized();
  joint.joint = joint.type == JointType::kPrismatic ? prismatic_joint(Transform{}, unit)
                                                    : revolute_joint(Transform{}, unit);
  if (limits) joint.limits = JointLimits{limits->first, limits->second};
  joint.position = position;
  joint.variance = variance;
  joint.strict = strict;
  return joint;
}

EdgeTiming timing_of(bool moving, py::handle span, std::optional<std::size_t> count,
                     py::handle process_noise, bool drifts, py::handle believed) {
  EdgeTiming timing;
  timing.moving = moving;
  timing.drifts = drifts;
  if (!span.is_none()) timing.span = to_duration(span, "span");
  timing.believed = not_negative(to_duration(believed, "believed"), "believed");
  if (count) timing.count = *count;
  if (!process_noise.is_none()) {
    const StatedCovariance noise = to_covariance(process_noise, "process_noise");
    if (!noise.complete()) throw py::value_error("process_noise must be specified");
    timing.process_noise = noise.of_specified();
  }
  return timing;
}

FrameSpec make_frame(std::string id, std::string parent, const Transform& X_PC,
                     std::optional<JointSpec> joint, bool moving, py::handle span,
                     std::optional<std::size_t> count, py::handle process_noise, bool drifts,
                     py::handle believed) {
  FrameSpec frame;
  frame.id = std::move(id);
  frame.parent = std::move(parent);
  frame.X_PC = X_PC;
  const EdgeTiming timing = timing_of(moving, span, count, process_noise, drifts, believed);
  const bool remembers = timing.believed.count() > 0;
  if (moving || drifts || !span.is_none() || count || !process_noise.is_none() || remembers) {
    frame.timing = timing;
  }
  if (joint) {
    joint->joint.X_PJ = X_PC;
    check(check_joint(*joint));
    frame.X_PC = value_at(*joint, joint->position, joint->variance);
    frame.joint = std::move(joint);
  }
  return frame;
}

std::vector<FrameSpec> load(std::string file, std::string root, const Transform& X_root,
                            std::string prefix, std::vector<std::string> links,
                            bool strict_limits) {
  UrdfPart part;
  part.file = std::move(file);
  part.root = std::move(root);
  part.X_root = X_root;
  part.prefix = std::move(prefix);
  part.links = std::move(links);
  part.strict_limits = strict_limits;
  return value_of(load_urdf(part));
}

std::vector<FrameSpec> read_frames(std::string path, const std::optional<std::string>& format,
                                   std::string prefix, std::map<std::string, std::string> names,
                                   double unit, py::handle covariance, std::string covariances) {
  FrameFile file;
  file.file = std::move(path);
  if (format) file.format = value_of(frame_format_named(*format));
  file.prefix = std::move(prefix);
  file.names = std::move(names);
  file.unit = unit;
  if (!covariance.is_none()) file.covariance = to_covariance(covariance);
  file.covariances = std::move(covariances);
  return value_of(load_frames(file));
}

py::dict sources_of(const FrameSpec& frame) {
  py::dict sources;
  for (const CommonError& error : frame.correlation.common_errors) {
    const Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::RowMajor> rows = error.loading;
    sources[py::str(error.source)] = read_only(rows.data(), {6, rows.cols()});
  }
  return sources;
}

// A Node is not told the file's history.
std::vector<FrameSpec> frames_of(const Config& config) {
  std::vector<FrameSpec> frames = config.frames;
  for (FrameSpec& frame : frames) {
    if (!frame.timing && !frame.parent.empty() && config.has_history) frame.timing = config.history;
  }
  return frames;
}

}  // namespace

void bind_frames(py::module_& module) {
  py::class_<JointSpec>(
      module, "Joint",
      "A joint that moves a frame by one number.\n\n"
      "type: 'revolute', 'continuous' or 'prismatic'. axis: (3,), of any length. limits: (lower,\n"
      "upper) [rad or m]. position, variance: before the first sample. strict: positions outside\n"
      "the limits are rejected. Its origin is the transform of the frame.")
      .def(py::init(&make_joint), py::arg("name"), py::arg("type") = "revolute",
           py::arg("axis") = py::make_tuple(0, 0, 1), py::kw_only(), py::arg("limits") = py::none(),
           py::arg("position") = 0.0, py::arg("variance") = py::none(), py::arg("strict") = false)
      .def_readonly("name", &JointSpec::name)
      .def_property_readonly("type", [](const JointSpec& joint) { return to_string(joint.type); })
      .def_readonly("position", &JointSpec::position)
      .def_readonly("variance", &JointSpec::variance);
  py::class_<FrameSpec>(
      module, "FrameSpec",
      "A frame of a new Node: its id, its parent ('' makes it a root), and where it is in it.\n\n"
      "joint: moves it; X_PC then is the origin. moving: samples need no stamps to count as such.\n"
      "span [s], count: how much history is kept. process_noise: covariance per second (6, 6).\n"
      "drifts: the error is a random walk of that density, as that of odometry is. believed [s]:\n"
      "how long it is remembered what was known before later changes: see lookup(believed_at=).")
      .def(py::init(&make_frame), py::arg("id"), py::arg("parent") = "",
           py::arg("X_PC") = Transform{}, py::kw_only(), py::arg("joint") = py::none(),
           py::arg("moving") = false, py::arg("span") = py::none(), py::arg("count") = py::none(),
           py::arg("process_noise") = py::none(), py::arg("drifts") = false,
           py::arg("believed") = 0.0)
      .def_readonly("id", &FrameSpec::id)
      .def_readonly("parent", &FrameSpec::parent)
      .def_readonly("X_PC", &FrameSpec::X_PC, "The value at the start.")
      .def_readonly("joint", &FrameSpec::joint)
      .def_property_readonly(
          "sources", &sources_of,
          "Errors that it shares with other frames: for each source a (6, k) loading.")
      .def_property_readonly(
          "correlation_unknown", [](const FrameSpec& frame) { return frame.correlation.unknown; },
          "Its own error may be correlated with any other.");
  py::class_<Config>(module, "Config", "The content of a daemon's YAML file.")
      .def_readonly("partition", &Config::partition, "Empty if the file names none.")
      .def_property_readonly("frames", &frames_of, "With the file's history, or their own.");
  module.def(
      "load_config", [](const std::string& path) { return value_of(load_config(path)); },
      py::arg("path"), "Reads a daemon's YAML file, and the URDF files that it names.");
  module.def("load_urdf", &load, py::arg("file"), py::arg("root") = "",
             py::arg("X_root") = Transform{}, py::kw_only(), py::arg("prefix") = "",
             py::arg("links") = std::vector<std::string>{}, py::arg("strict_limits") = false,
             "Reads the frames of a robot, each moved by its joint.\n\n"
             "root: the frame in which the robot's root link is, at X_root. prefix: of all names.\n"
             "links: what to load, as LINK or FROM..TO; none: all.");
  module.def(
      "read_frames", &read_frames, py::arg("file"), py::kw_only(), py::arg("format") = py::none(),
      py::arg("prefix") = "", py::arg("names") = std::map<std::string, std::string>{},
      py::arg("unit") = 1.0, py::arg("covariance") = py::none(), py::arg("covariances") = "",
      "Reads the edges of a calibration, launch file or pose graph, parents first.\n\n"
      "format: 'kalibr', 'eye-on-hand', 'eye-on-base', 'ros1', 'ros2', 'opencv', 'colmap',\n"
      "'g2o'; None: told from the content. prefix: of all names, but those that names gives,\n"
      "by the name in the file. unit: of lengths in the file [m]. covariance: of edges for\n"
      "which the file has none. covariances: the file of pycolmap's covariances. At most\n"
      "64 MiB are read. Raises TransformException with file, line and key.");
  module.def(
      "write_frames",
      [](const std::vector<FrameSpec>& frames, const std::string& format) {
        return value_of(write_frames(frames, value_of(frame_format_named(format))));
      },
      py::arg("frames"), py::arg("format"),
      "The text of a file with these edges, parents first; formats as of read_frames().");
}

}  // namespace tfdude::python
