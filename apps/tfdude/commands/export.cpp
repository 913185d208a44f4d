#include <map>
#include <set>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/description/frame_file.hpp"

#include "../commands.hpp"
#include "../frame_formats.hpp"
#include "../output.hpp"

namespace tfdude::cli {
namespace {

struct Export final : Question {
  explicit Export(CLI::App& app) {
    app.add_option("FILE", file, "the file to write; -: standard output")
        ->type_name("FILE")
        ->required();
    app.add_option("FRAME", ids, "the frames, in this order; default: all that have a parent");
    add_format(app, format, "of the file")->required();
    app.add_option("--in", in, "the frame in which they are placed; default: the parent of each");
    add_instant(app, at);
    add_recording(app);
  }

  int ask_source(Source source, const Common& common) const override {
    const auto named = frame_format_named(format);
    if (!named) return report(named.error(), common);
    const auto frames = edges(source);
    if (!frames) return report_cause(source, frames.error(), common);
    const int status = check_partitions(source, common, !frames->empty());
    if (status != kDone) return status;
    const auto text = write_frames(*frames, *named);
    if (!text) return report(text.error(), common);
    auto written = nlohmann::json::array();
    for (const FrameSpec& frame : *frames) written.push_back(frame.id);
    nlohmann::json json{{"file", file}, {"format", format}, {"frames", written}};
    if (file == "-" || is_standard_output(file)) {
      json["text"] = *text;
      return answer(common, json, *text);
    }
    if (auto ok = write_file(file, *text); !ok) return report(ok.error(), common);
    return answer(common, json, "wrote " + printable(file) + "\n");
  }

  [[nodiscard]] Result<std::vector<FrameSpec>> edges(Source source) const {
    const auto instant = optional_stamp(source, at);
    if (!instant) return tl::unexpected(instant.error());
    Query query;
    query.at = *instant;
    const auto all = source.frames();
    if (!all) return tl::unexpected(all.error());
    std::map<std::string, std::string> parents;
    std::set<std::string> known;
    for (const Frame& frame : *all) {
      known.insert(frame.id);
      if (frame.attached) parents[frame.id] = frame.parent;
    }
    std::vector<FrameSpec> frames;
    for (const std::string& id : ids.empty() ? in_order(parents) : ids) {
      FrameSpec frame;
      frame.id = id;
      frame.parent = in.empty() ? parents[id] : in;
      if (frame.parent.empty() && known.count(id) == 0) {
        return fail(Errc::kUnknownFrame, "no frame " + quote(id));
      }
      if (frame.parent.empty()) {
        return fail(Errc::kUnknownFrame, "frame " + quote(id) + " has no parent; say --in FRAME");
      }
      if (id == in) continue;
      auto X_PC = source.lookup(frame.parent, id, query);
      if (!X_PC) return tl::unexpected(std::move(X_PC.error()));
      frame.X_PC = *X_PC;
      // How it is correlated does not fit into any file; that it is does.
      frame.correlation.unknown = X_PC->basis.bound || !X_PC->basis.sources.empty();
      frames.push_back(std::move(frame));
    }
    return frames;
  }

  // All frames, parents before their children.
  [[nodiscard]] static std::vector<std::string> in_order(
      const std::map<std::string, std::string>& parents) {
    std::vector<std::string> ordered;
    std::set<std::string> done;
    for (const auto& entry : parents) {
      std::vector<std::string> chain;  // upwards
      for (auto at = parents.find(entry.first);
           at != parents.end() && !at->second.empty() && done.insert(at->first).second;
           at = parents.find(at->second)) {
        chain.push_back(at->first);
      }
      ordered.insert(ordered.end(), chain.rbegin(), chain.rend());
    }
    return ordered;
  }

  std::string file;
  std::vector<std::string> ids;
  std::string format;
  std::string in;
};

}  // namespace

void add_export(Commands& commands) {
  commands.add<Export>("export", "write frames as a calibration, launch file or pose graph",
                       "export camchain.yaml cam0 cam1 --format kalibr --in imu_link");
}

}  // namespace tfdude::cli
