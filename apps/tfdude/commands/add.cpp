#include "../commands.hpp"

namespace tfdude::cli {
namespace {

struct Add final : FrameCommand {
  explicit Add(CLI::App& app) : FrameCommand(app) {
    app.add_option("--parent", parent, "its parent")->required();
    app.add_option("--partition", partition, "its owner, if not its parent's");
    add_pose(app, spec);
  }

  int ask(Client& client, const Common& common) const override {
    const auto X_PC = typed_pose(spec, common, id);
    if (!X_PC) return report(X_PC.error(), common);
    return answer_done(client, common, client.add(id, parent, *X_PC, partition), "added", id);
  }

  std::string parent;
  std::string partition;
  TransformSpec spec;
};

}  // namespace

void add_add(Commands& commands) {
  commands.add<Add>("add", "add a frame", "add tool --parent camera --xyz 0.1 0 -0.2");
}

}  // namespace tfdude::cli
