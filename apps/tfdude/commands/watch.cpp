#include "../commands.hpp"
#include "../path.hpp"

namespace tfdude::cli {
namespace {

struct Watch final : LiveCommand {
  explicit Watch(CLI::App& app) {
    until_interrupted = true;
    path.add_ends(app);
    add_watch_options(app, options);
    path.add_printing(app);
  }

  int ask(Client& client, const Common& common) const override {
    return follow(client, common, path, options,
                  [&](const StampedTransform& X_AB) { (void)path.print(client, common, X_AB); });
  }

  Path path;
  WatchOptions options;
};

}  // namespace

void add_watch(Commands& commands) {
  commands.add<Watch>("watch", "follow a path: its owners push what changes",
                      "watch world hand_left --rate 5");
}

}  // namespace tfdude::cli
