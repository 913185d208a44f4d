#include "../commands.hpp"

namespace tfdude::cli {
namespace {

struct Parent final : FrameCommand {
  using FrameCommand::FrameCommand;

  int ask(Client& client, const Common& common) const override {
    const auto parent = client.parent(id);
    if (!parent) return report_cause(client, parent.error(), common);
    const auto json = parent->empty() ? nlohmann::json() : nlohmann::json(*parent);
    return answer(common, {{"id", id}, {"parent", json}},
                  (parent->empty() ? "(root)" : *parent) + "\n");
  }
};

}  // namespace

void add_parent(Commands& commands) {
  commands.add<Parent>("parent", "a frame's parent", "parent hand_left");
}

}  // namespace tfdude::cli
