#include "../commands.hpp"

namespace tfdude::cli {
namespace {

struct Remove final : FrameCommand {
  using FrameCommand::FrameCommand;

  int ask(Client& client, const Common& common) const override {
    return answer_done(client, common, client.remove(id), "removed", id);
  }
};

}  // namespace

void add_remove(Commands& commands) {
  commands.add<Remove>("remove", "remove a frame and all below it", "remove tool");
}

}  // namespace tfdude::cli
