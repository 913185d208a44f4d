#include "../commands.hpp"

namespace tfdude::cli {
namespace {

struct Forget final : LiveCommand {
  explicit Forget(CLI::App& app) {
    app.add_option("PARTITION", partition, "the partition; rejected while it is reachable")
        ->required();
  }

  int ask(Client& client, const Common& common) const override {
    return answer_done(client, common, client.forget(partition), "forgotten", partition);
  }

  std::string partition;
};

}  // namespace

void add_forget(Commands& commands) {
  commands.add<Forget>("forget", "delete all data of a partition that will not return",
                       "forget arm");
}

}  // namespace tfdude::cli
