#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/description/frame_file.hpp"

#include "../../rendering/format.hpp"
#include "../../rendering/json.hpp"
#include "../commands.hpp"
#include "../frame_formats.hpp"
#include "../importing.hpp"

namespace tfdude::cli {
namespace {

nlohmann::json json_of(const std::vector<FrameSpec>& frames) {
  auto list = nlohmann::json::array();
  for (const FrameSpec& frame : frames) {
    list.push_back({{"id", frame.id},
                    {"parent", frame.parent},
                    {"translation", numbers_json(frame.X_PC.pose.translation())},
                    {"rotation", numbers_json(frame.X_PC.pose.rotation().coeffs())}});
  }
  return list;
}

std::string text_of(const std::vector<FrameSpec>& frames) {
  std::string text;
  for (const FrameSpec& frame : frames) {
    const Eigen::Vector3d p = frame.X_PC.pose.translation();
    const Eigen::Vector3d rpy = to_rpy(frame.X_PC.pose.rotation());
    text += frame.id + " in " + frame.parent +
            format(": %.6f  %.6f  %.6f  m, %.6f  %.6f  %.6f  rad\n", p.x(), p.y(), p.z(), rpy.x(),
                   rpy.y(), rpy.z());
  }
  return text;
}

struct Import final : LiveCommand {
  explicit Import(CLI::App& app) {
    app.add_option("FILE", file.file, "the file")->type_name("FILE")->required();
    app.add_option("--into", partition, "the partition that will own the frames");
    add_format(app, format, "which it is; default: told from the content");
    app.add_option("--prefix", file.prefix, "prepended to the names of all frames");
    app.add_option("--name", names, "another name for a frame; instead of the prefix")
        ->type_name("NAME=FRAME")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
        ->check([](const std::string& text) {
          const auto at = text.find('=');
          const bool both = at != std::string::npos && at > 0 && at + 1 < text.size();
          return both ? "" : quote(text) + " is not NAME=FRAME";
        });
    app.add_option("--unit", file.unit, "the length of 1 in the file [m]; default: 1");
    app.add_option("--covariances", file.covariances,
                   "COLMAP: a file with a line for each image, its IMAGE_ID and the 36 numbers of "
                   "pycolmap's get_cam_cov_from_world()")
        ->type_name("FILE");
    add_covariance(app, spec);
    app.add_flag("--dry-run", dry_run, "print the frames, and change nothing");
    app.parse_complete_callback([this] {
      if (partition.empty() && !dry_run) throw CLI::RequiredError("--into or --dry-run");
    });
  }

  int run(const Common& common) const override {
    if (!dry_run) return LiveCommand::run(common);
    const auto frames = read(common);
    if (!frames) return report(frames.error(), common);
    return answer(common, {{"done", "read"}, {"frames", json_of(*frames)}}, text_of(*frames));
  }

  int ask(Client& client, const Common& common) const override {
    const auto frames = read(common);
    if (!frames) return report(frames.error(), common);
    const auto done = import_frames(client, partition, *frames);
    if (!done) return report_cause(client, done.error(), common);
    return answer(common,
                  {{"done", "imported"}, {"partition", partition}, {"frames", json_of(*frames)}},
                  text_of(*frames));
  }

  [[nodiscard]] Result<std::vector<FrameSpec>> read(const Common& common) const {
    FrameFile read = file;
    if (!format.empty()) {
      const auto named = frame_format_named(format);
      if (!named) return tl::unexpected(named.error());
      read.format = *named;
    }
    for (const std::string& text : names) {
      const auto at = text.find('=');
      const std::string name = text.substr(0, at);
      if (!read.names.emplace(name, text.substr(at + 1)).second) {
        return fail(Errc::kInvalidInput, "--name " + quote(name) + " is given twice");
      }
    }
    const auto given = in_radians(spec, common.angles).build();
    if (!given) return tl::unexpected(given.error());
    read.covariance = given->covariance;
    return load_frames(read);
  }

  FrameFile file;
  std::string format;
  std::string partition;
  std::vector<std::string> names;  // as typed
  TransformSpec spec;              // the covariance of edges for which the file has none
  bool dry_run = false;
};

}  // namespace

void add_import(Commands& commands) {
  commands.add<Import>("import", "add or update the frames of a calibration or pose graph",
                       "import camchain.yaml --into head --name imu0=imu_link");
}

}  // namespace tfdude::cli
