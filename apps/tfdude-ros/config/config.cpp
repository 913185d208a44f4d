#include "config.hpp"

#include <array>
#include <filesystem>
#include <map>
#include <string_view>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/base/number.hpp"
#include "tfdude/math/transform_spec.hpp"

#include "description/file_text.hpp"
#include "mapping.hpp"
#include "topics.hpp"

namespace tfdude::ros {
namespace {

constexpr double kMaxStddev = 1e9;

Result<void> tf_in(const Section& section, Settings& settings) {
  // "tf_in: false" instead of a mapping.
  if (section.node.IsScalar() && section.node.Scalar() == "false") {
    settings.frames_in.reset();
    return {};
  }
  constexpr std::array<Key, 5> kKeys = {"frames", "except", "stddev", "cov", "covariance"};
  ImportSettings& in = settings.frames_in.emplace();
  Transform X{Pose(), in.covariance};
  const auto ok = Mapping(section.file, section.node, kKeys, "tf_in")
                      .patterns("frames", in.frames.include)
                      .patterns("except", in.frames.exclude)
                      .transform(X)
                      .result();
  in.covariance = X.covariance;
  return ok;
}

Result<void> tf_out(const Section& section, Settings& settings) {
  ExportSettings& out = settings.frames_out.emplace();
  constexpr std::array<Key, 3> kKeys = {"partitions", "frames", "rate"};
  return Mapping(section.file, section.node, kKeys, "tf_out")
      .patterns("partitions", out.partitions)
      .patterns("frames", out.frames)
      .within("rate", 0, kMaxRate, out.rate)
      .result();
}

Result<void> joints_in(const Section& section, Settings& settings) {
  JointImportSettings& in = settings.joints_in.emplace();
  constexpr std::array<Key, 5> kKeys = {"stddev", "stddev_of", "joints", "except", "partition"};
  Mapping entries(section.file, section.node, kKeys, "joints_in");
  entries.within("stddev", 0, kMaxStddev, in.stddev)
      .patterns("joints", in.joints.include)
      .patterns("except", in.joints.exclude)
      .words("partition", in.partition);
  if (!in.partition.empty()) entries.check(check_partition_name(in.partition));
  return entries.within("stddev_of", 0, kMaxStddev, in.stddev_of).result();
}

Result<void> joints_out(const Section& section, Settings& settings) {
  JointExportSettings& out = settings.joints_out.emplace();
  return Mapping(section.file, section.node, std::array<Key, 2>{"partitions", "rate"}, "joints_out")
      .require("partitions")
      .patterns("partitions", out.partitions)
      .within("rate", 0.001, kMaxRate, out.rate)
      .result();
}

Result<void> description_in(const Section& section, Settings& settings) {
  constexpr std::array<Key, 11> kKeys = {"partition", "root",       "xyz",           "rpy",
                                         "quat",      "links",      "strict_limits", "stddev",
                                         "cov",       "covariance", "fixed"};
  DescriptionSettings& in = settings.description_in.emplace();
  std::string fixed;
  in.part.X_root = Transform{Pose(), {}};
  Mapping entries(section.file, section.node, kKeys, "description_in");
  entries.words("partition", in.partition)
      .words("root", in.part.root)
      .list("links", in.part.links)
      .flag("strict_limits", in.part.strict_limits)
      .words("fixed", fixed)
      .transform(in.part.X_root);
  entries.check(check_new_partition_name(in.partition));
  if (entries.result() && !fixed.empty()) {
    const auto stated = covariance_named(fixed);
    if (!stated) return entries.fail(stated.error().code, stated.error().message).result();
    in.part.fixed = *stated;
  }
  return entries.result();
}

Result<void> description_out(const Section& section, Settings& settings) {
  DescriptionOutSettings& out = settings.description_out.emplace();
  if (section.node.IsMap()) {
    constexpr std::array<Key, 1> kKeys = {"partition"};
    Mapping entries(section.file, section.node, kKeys, "description_out");
    entries.require("partition").words("partition", out.partition);
    return entries.check(check_partition_name(out.partition)).result();
  }
  const auto file =
      Scalars(section.file).text({section.node, section.node.Mark()}, "description_out");
  if (!file) return tl::unexpected(file.error());
  out.file = (std::filesystem::path(section.file).parent_path() / *file).string();
  return {};
}

Result<void> clock_out(const Section& section, Settings& settings) {
  settings.clock_out = 100;
  Mapping entries(section.file, section.node, std::array<Key, 1>{"rate"}, "clock_out");
  entries.within("rate", 0.001, kMaxRate, settings.clock_out);
  return entries
      .check(settings.options.clock == ClockKind::kExternal && !settings.passes_clock,
             Errc::kInvalidInput, " needs clock: external, and another source of the time than ROS")
      .result();
}

Result<void> drifts(const Section& section, Settings& settings) {
  Mapping entries(section.file, section.node, std::array<Key, 0>{}, "drifts");
  for (const std::string& frame : entries.keys()) {
    std::optional<std::array<double, 6>> stddev;
    if (!entries.six(frame, stddev).result()) break;
    const auto density = Covariance::from_stddev(*stddev);
    if (!density) {
      const std::string why = "drifts: " + frame + ": " + density.error().message;
      return entries.fail(density.error().code, why, frame).result();
    }
    settings.drifts.emplace(without_slashes(frame), *density);
  }
  return entries.result();
}

Result<void> read(const YAML::Node& root, const std::string& file, Settings& settings) {
  static constexpr std::array<std::pair<Key, Result<void> (*)(const Section&, Settings&)>, 12>
      kSections = {{{"tf_in", tf_in},
                    {"tf_out", tf_out},
                    {"joints_in", joints_in},
                    {"joints_out", joints_out},
                    {"description_in", description_in},
                    {"description_out", description_out},
                    {"clock_out", clock_out},
                    {"drifts", drifts},
                    {"values_in", values_in},
                    {"detections_in", detections_in},
                    {"poses_in", poses_in},
                    {"poses_out", poses_out}}};
  constexpr std::array<Key, 16> kKeys = {
      "partition", "clock",         "ros_domain",     "prefix",          "tf_in",     "tf_out",
      "joints_in", "joints_out",    "description_in", "description_out", "clock_out", "drifts",
      "values_in", "detections_in", "poses_in",       "poses_out"};
  double domain = settings.ros_domain;
  std::string prefix;
  std::string clock = "system";
  Mapping entries(file, root, kKeys, "the file");
  entries.words("partition", settings.partition)
      .within("ros_domain", 0, 232, domain)
      .words("prefix", prefix)
      .words("clock", clock);
  if (!entries.result()) return entries.result();
  if (clock != "system" && clock != "external" && clock != "ros") {
    return entries
        .fail(Errc::kInvalidInput,
              "clock must be system, external or ros, not " + tfdude::quote(clock), "clock")
        .result();
  }
  if (clock != "system") settings.options.clock = ClockKind::kExternal;
  settings.passes_clock = clock == "ros";
  settings.ros_domain = static_cast<std::uint32_t>(domain);
  for (const auto& [key, section] : kSections) {
    const YAML::Node* node = entries.value(key);
    if (node == nullptr) continue;
    if (auto ok = section({*node, file}, settings); !ok) return ok;
  }
  set_prefix(prefix, settings);
  return {};
}

}  // namespace

Result<void> parse_config(const std::string& text, const std::string& name, Settings& settings) {
  return Scalars(name).read_document(
      text, [&](const YAML::Node& root) { return read(root, name, settings); });
}

Result<void> load_config(const std::string& path, Settings& settings) {
  const auto text = read_text(path);
  if (!text) return tl::unexpected(text.error());
  return parse_config(*text, path, settings);
}

}  // namespace tfdude::ros
