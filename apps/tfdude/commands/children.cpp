#include "../commands.hpp"

namespace tfdude::cli {
namespace {

struct Children final : FrameCommand {
  using FrameCommand::FrameCommand;

  int ask(Client& client, const Common& common) const override {
    const auto children = client.children(id);
    if (!children) return report_cause(client, children.error(), common);
    return answer_list(common, "children", *children);
  }
};

}  // namespace

void add_children(Commands& commands) {
  commands.add<Children>("children", "a frame's children", "children arm_1");
}

}  // namespace tfdude::cli
