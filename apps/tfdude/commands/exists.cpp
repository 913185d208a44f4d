#include "../commands.hpp"

namespace tfdude::cli {
namespace {

struct Exists final : FrameCommand {
  explicit Exists(CLI::App& app) : FrameCommand(app) { single_frames = true; }

  int ask(Client& client, const Common& common) const override {
    const auto parent = client.parent(id);
    if (!parent && !is_unknown(parent.error().code)) {
      return report_cause(client, parent.error(), common);
    }
    const bool exists = parent.has_value();
    if (const int status = check_partitions(client, common, exists); status != kDone) return status;
    (void)answer(common, {{"id", id}, {"exists", exists}}, exists ? "yes\n" : "no\n");
    return exists ? kDone : kRejected;
  }
};

}  // namespace

void add_exists(Commands& commands) {
  commands.add<Exists>("exists", "whether a frame exists", "exists camera");
}

}  // namespace tfdude::cli
