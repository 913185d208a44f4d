#include "../commands.hpp"
#include "../structure.hpp"

namespace tfdude::cli {
namespace {

struct Frames final : Question {
  explicit Frames(CLI::App& app) { add_recording(app); }

  int ask_source(Source source, const Common& common) const override {
    const auto all = Structure::of(source);
    if (!all) return report(all.error(), common);
    std::string text;
    for (const Frame& frame : all->frames) text += frame.id + "\n";
    const int status = check_partitions(source, common, !all->frames.empty());
    return status == kDone ? all->print(common, text) : status;
  }
};

}  // namespace

void add_frames(Commands& commands) {
  commands.add<Frames>("frames", "list all frames", "--json frames");
}

}  // namespace tfdude::cli
