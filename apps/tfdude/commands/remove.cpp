#include "../answer.hpp"
#include "../commands.hpp"
#include "../options.hpp"

namespace tfdude::cli {
namespace {

struct Remove final : LiveCommand {
  explicit Remove(CLI::App& app) { add_id(app, id); }

  int ask(Client& client, const Common& common) const override {
    return answer_done(client, common, client.remove(id), "removed", id);
  }

  std::string id;
};

}  // namespace

void add_remove(Commands& commands) {
  commands.add<Remove>("remove", "remove a frame and all below it", "remove tool");
}

}  // namespace tfdude::cli
