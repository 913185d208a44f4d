#include <algorithm>
#include <map>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/description/frame_file.hpp"

#include "../../rendering/format.hpp"
#include "../../rendering/json.hpp"
#include "../commands.hpp"
#include "../frame_formats.hpp"

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
    const auto done = apply(client, *frames);
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

  // First all that can be known to fail, then the structure, then all values in one commit. Until
  // then new edges are unspecified, so nobody sees an own part without the common errors.
  [[nodiscard]] Result<void> apply(Client& client, const std::vector<FrameSpec>& frames) const {
    const auto all = client.frames();
    if (!all) return tl::unexpected(all.error());
    std::map<std::string, const Frame*> known;
    for (const Frame& frame : *all) known[frame.id] = &frame;
    if (auto ok = check(frames, known); !ok) return ok;
    std::vector<EdgeUpdate> values;
    for (const FrameSpec& frame : frames) {
      const Transform unspecified{frame.X_PC.pose, {}};
      const auto found = known.find(frame.id);
      Result<void> done;
      if (known.count(frame.parent) == 0) {
        done = client.add(frame.parent, "", Transform::exact({}), partition);
        known[frame.parent] = nullptr;
      }
      if (done && found == known.end()) {
        done = client.add(frame.id, frame.parent, unspecified, partition);
        known[frame.id] = nullptr;
      } else if (done && found->second->parent != frame.parent) {
        done = client.move(frame.id, frame.parent, unspecified);
      }
      const bool correlated = !frame.correlation.empty() || found != known.end();
      if (done && correlated) done = client.correlate(frame.id, frame.correlation);
      if (!done) return fail_at("frame " + quote(frame.id), done.error());
      values.push_back({frame.id, frame.X_PC});
    }
    constexpr std::size_t kAtOnce = 4096;  // what an owner accepts
    for (std::size_t first = 0; first < values.size(); first += kAtOnce) {
      const std::size_t end = std::min(first + kAtOnce, values.size());
      const auto at = [&](std::size_t i) {
        return values.begin() + static_cast<std::ptrdiff_t>(i);
      };
      auto done = client.update(std::vector<EdgeUpdate>(at(first), at(end)));
      if (!done) return done;
    }
    return {};
  }

  // Frames of other partitions stay theirs, and no frame may come below itself.
  [[nodiscard]] Result<void> check(const std::vector<FrameSpec>& frames,
                                   const std::map<std::string, const Frame*>& known) const {
    std::map<std::string, std::string> parents;
    for (const auto& [id, frame] : known) parents[id] = frame->parent;
    for (const FrameSpec& frame : frames) {
      parents[frame.id] = frame.parent;
      const auto found = known.find(frame.id);
      if (found == known.end() || found->second->partition == partition) continue;
      return fail(Errc::kAlreadyExists, "frame " + quote(frame.id) + " belongs to partition " +
                                            quote(found->second->partition));
    }
    for (const FrameSpec& frame : frames) {
      std::size_t steps = 0;
      for (auto at = parents.find(frame.id); at != parents.end(); at = parents.find(at->second)) {
        if (++steps <= parents.size()) continue;
        return fail(Errc::kCycle, "frame " + quote(frame.id) + ": its new parent " +
                                      quote(frame.parent) + " lies below it");
      }
    }
    return {};
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
