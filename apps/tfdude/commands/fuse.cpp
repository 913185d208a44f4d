#include "../commands.hpp"
#include "../measurement.hpp"

namespace tfdude::cli {
namespace {

struct Fuse final : FrameCommand {
  explicit Fuse(CLI::App& app) : FrameCommand(app) { measured.add_options(app); }

  int ask(Client& client, const Common& common) const override {
    return measured.send(client, common, [&](const Transform& X_PC, std::optional<Time> stamp) {
      return client.fuse(id, X_PC, stamp, measured.how);
    });
  }

  Measurement measured;
};

}  // namespace

void add_fuse(Commands& commands) {
  commands.add<Fuse>("fuse", "fuse a measurement of an edge with its value",
                     "fuse camera --xyz 0.1 0 0.3 --stddev 1e-3 1e-3 1e-3 2e-3 2e-3 2e-3");
}

}  // namespace tfdude::cli
