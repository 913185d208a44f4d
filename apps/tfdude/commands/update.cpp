#include "../commands.hpp"

namespace tfdude::cli {
namespace {

struct Update final : FrameCommand {
  explicit Update(CLI::App& app) : FrameCommand(app) {
    add_pose(app, spec);
    add_sample_stamp(app, stamp);
  }

  int ask(Client& client, const Common& common) const override {
    const auto parts = typed_parts(spec, common, id);
    if (!parts) return report(parts.error(), common);
    const auto at = optional_stamp(client, stamp);
    if (!at) return report(at.error(), common);
    return answer_done(client, common, client.update_partial({{id, *parts}}, *at), "updated", id);
  }

  TransformSpec spec;
  std::string stamp;
};

}  // namespace

void add_update(Commands& commands) {
  commands.add<Update>("update", "set parts of an edge; other parts stay unchanged",
                       "update tool --rpy 0 0 1.57");
}

}  // namespace tfdude::cli
