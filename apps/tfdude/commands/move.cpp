#include "../commands.hpp"

namespace tfdude::cli {
namespace {

struct Move final : FrameCommand {
  explicit Move(CLI::App& app) : FrameCommand(app) {
    app.add_option("--parent", parent, "the new parent");
    app.add_option("--to-owner", owner,
                   "the partition that owns it, and all below it, from now on");
    add_pose(app, spec);
  }

  int ask(Client& client, const Common& common) const override {
    const auto parts = typed_parts(spec, common, id);
    if (!parts) return report(parts.error(), common);
    if (!parent && (!owner || !parts->empty())) {
      return report({Errc::kInvalidInput, owner ? "a new pose needs a new parent (--parent)"
                                                : "move needs --parent, --to-owner or both"},
                    common);
    }
    return answer_done(client, common, moved(client, *parts), "moved", id);
  }

  Result<void> moved(Client& client, const PartialTransform& parts) const {
    if (!owner) return client.move(id, *parent, parts);
    return parent ? client.hand_over(id, *owner, *parent, parts) : client.hand_over(id, *owner);
  }

  std::optional<std::string> parent;
  std::optional<std::string> owner;
  TransformSpec spec;
};

}  // namespace

void add_move(Commands& commands) {
  commands.add<Move>("move", "move a frame to a new parent, or to a new owner",
                     "move tool --parent arm_2");
}

}  // namespace tfdude::cli
