#include "../commands.hpp"
#include "../measurement.hpp"
#include "../path.hpp"

namespace tfdude::cli {
namespace {

struct Observe final : LiveCommand {
  explicit Observe(CLI::App& app) {
    path.add_ends(app);
    measured.add_options(app);
  }

  int ask(Client& client, const Common& common) const override {
    return measured.send(client, common, [&](const Transform& X_AB, std::optional<Time> stamp) {
      return client.observe(path.a, path.b, X_AB, stamp, measured.how);
    });
  }

  Path path;
  Measurement measured;
};

}  // namespace

void add_observe(Commands& commands) {
  commands.add<Observe>("observe", "correct the edges of a path by a measurement of B in A",
                        "observe world tool --xyz 0.8 0.1 1.1 --stddev 1e-3 1e-3 1e-3 "
                        "2e-3 2e-3 2e-3");
}

}  // namespace tfdude::cli
