#include "velocity.hpp"

#include <cmath>

#include "../../rendering/format.hpp"
#include "../../rendering/json.hpp"
#include "../commands.hpp"
#include "../path.hpp"

namespace tfdude::cli {

std::string describe(const Velocity& velocity, const Shown& shown) {
  const Eigen::Vector3d& v = velocity.linear;
  const Eigen::Vector3d& w = velocity.angular;
  const auto s = velocity.covariance.of_specified().stddev();
  std::string text = format("linear       %.6f  %.6f  %.6f  m/s\n", v.x(), v.y(), v.z());
  text += "angular      " + angles_text(w.x(), w.y(), w.z(), shown.angles, "/s") + "\n";
  const bool complete = velocity.covariance.complete();
  if (!complete) text += "std dev      " + unspecified_text(velocity.basis.unspecified) + "\n";
  text += (complete ? "std dev      " : "  of others  ") +
          format("%.6f  %.6f  %.6f  m/s\n", s[0], s[1], s[2]);
  text += "             " + angles_text(s[3], s[4], s[5], shown.angles, "/s") + "\n";
  if (shown.covariance) {
    text += format("covariance   %s(linear first; m/s, %s/s)\n", complete ? "" : "of the others ",
                   shown.angles.name);
    text += matrix_table(velocity.covariance.of_specified().matrix(), shown.angles);
  }
  if (velocity.begin && velocity.end) {
    text += "from         " + seconds_of(*velocity.begin) + "\nto           " +
            seconds_of(*velocity.end) + "\n";
  } else {
    text += "interval     none: all edges are static\n";
  }
  return text + describe(velocity.basis);
}

nlohmann::json velocity_json(const std::string& a, const std::string& b, const Velocity& velocity) {
  nlohmann::json json{{"from", a},
                      {"to", b},
                      {"linear", numbers_json(velocity.linear)},
                      {"angular", numbers_json(velocity.angular)},
                      {"begin_ns", ns_json(velocity.begin)},
                      {"end_ns", ns_json(velocity.end)},
                      {"basis", basis_json(velocity.basis)}};
  add_covariance(json, velocity.covariance);
  return json;
}

namespace {

struct VelocityCommand final : LiveCommand {
  explicit VelocityCommand(CLI::App& app) {
    single_frames = true;
    path.add_ends(app);
    add_covariance_flag(app, path.covariance);
    explain_angles(app);
    add_stamp(app, "--at", at,
              "the middle of the interval: seconds since the epoch or, negative, before now; "
              "default: it ends at the latest common time");
    app.add_option("--over", over, "length of the interval [s]")
        ->check(within(1e-6, 1e6, "1e-6 to 1e6"));
  }

  int ask(Client& client, const Common& common) const override {
    const auto middle = optional_stamp(client, at);
    if (!middle) return report_cause(client, middle.error(), common);
    const std::chrono::nanoseconds length(static_cast<std::int64_t>(over * 1e9));
    const auto velocity = client.velocity(path.a, path.b, {*middle, length});
    if (!velocity) return report_cause(client, velocity.error(), common);
    return answer(common, velocity_json(path.a, path.b, *velocity),
                  describe(*velocity, {common.angles, path.covariance, false}));
  }

  Path path;
  std::string at;
  double over = 0.1;
};

}  // namespace

void add_velocity(Commands& commands) {
  commands.add<VelocityCommand>("velocity", "mean velocity of B in A over an interval",
                                "velocity world hand_left --over 0.05");
}

}  // namespace tfdude::cli
