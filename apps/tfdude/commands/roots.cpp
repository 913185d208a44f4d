#include "../commands.hpp"

namespace tfdude::cli {
namespace {

struct Roots final : PlainCommand {
  using PlainCommand::PlainCommand;

  int ask(Client& client, const Common& common) const override {
    const auto roots = client.roots();
    if (!roots) return report(roots.error(), common);
    const int status = check_partitions(client, common, !roots->empty());
    return status == kDone ? answer_list(common, "roots", *roots) : status;
  }
};

}  // namespace

void add_roots(Commands& commands) {
  commands.add<Roots>("roots", "list roots: frames whose parent does not exist", "roots");
}

}  // namespace tfdude::cli
