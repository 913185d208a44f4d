#include "../commands.hpp"

namespace tfdude::cli {
namespace {

struct Move final : FrameCommand {
  explicit Move(CLI::App& app) : FrameCommand(app) {
    app.add_option("--parent", parent, "the new parent")->required();
    add_pose(app, spec);
  }

  int ask(Client& client, const Common& common) const override {
    const auto parts = typed_parts(spec, common, id);
    if (!parts) return report(parts.error(), common);
    return answer_done(client, common, client.move(id, parent, *parts), "moved", id);
  }

  std::string parent;
  TransformSpec spec;
};

}  // namespace

void add_move(Commands& commands) {
  commands.add<Move>("move", "move a frame to a new parent", "move tool --parent arm_2");
}

}  // namespace tfdude::cli
