#include "../../rendering/explanation.hpp"
#include "../commands.hpp"
#include "../path.hpp"

namespace tfdude::cli {
namespace {

int status_of(const Explanation& why) {
  if (!why.cause) return kDone;
  if (why.cause->error.code == Errc::kTimeout) return kNoAnswer;
  switch (why.cause->obstacle) {
    case Obstacle::kOwnerLost:
    case Obstacle::kOwnerStopped:
    case Obstacle::kOwnerSilent:
    case Obstacle::kNobody:
      return kNoAnswer;
    default:
      return kRejected;
  }
}

struct Why final : LiveCommand {
  explicit Why(CLI::App& app) {
    path.add_ends(app);
    add_instant(app, at);
    app.add_option("--sensor", sensor,
                   "standard deviations [m] and [rad] of the measurement that is tried")
        ->expected(2);
  }

  int ask(Client& client, const Common& common) const override {
    const auto instant = optional_stamp(client, at);
    if (!instant) return report_cause(client, instant.error(), common);
    WhyQuery query;
    query.at = *instant;
    if (!sensor.empty()) {
      for (std::size_t i = 0; i < query.sensor.size(); ++i) query.sensor[i] = sensor[i / 3];
    }
    const Explanation why = client.why(path.a, path.b, query);
    (void)answer(common, why_json(path.a, path.b, why), describe(path.a, path.b, why));
    return status_of(why);
  }

  Path path;
  std::string at;
  std::vector<double> sensor;
};

}  // namespace

void add_why(Commands& commands) {
  commands.add<Why>("why", "why B in A is so uncertain, or why there is no answer",
                    "why map gripper_link");
}

}  // namespace tfdude::cli
