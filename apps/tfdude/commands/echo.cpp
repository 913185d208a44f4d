#include "echo.hpp"

#include <cmath>

#include "tfdude/math/perturbation.hpp"
#include "tfdude/recording/recording.hpp"

#include "../../rendering/format.hpp"
#include "../../rendering/screen.hpp"
#include "../../rendering/table.hpp"
#include "../../rendering/text.hpp"
#include "../commands.hpp"
#include "../path.hpp"

namespace tfdude::cli {

std::string echo_lines(const std::string& a, const std::string& b, const StampedTransform& X_AB,
                       std::optional<Time> now, const AngleUnit& angles,
                       const std::vector<std::string>& assumed) {
  const Eigen::Vector3d t = X_AB.pose.translation();
  const Eigen::Vector3d rpy = to_rpy(X_AB.pose.rotation()) * angles.per_radian;
  const auto s = stddev_in_parent(X_AB);
  std::string text = shortened(b, room(34, 34)) + " seen from " + shortened(a, room(34, 34)) + "\n";
  text += format("position  %12.6f %12.6f %12.6f m\n", t.x(), t.y(), t.z());
  const auto row = [&](double x, double y, double z) {
    return format("%12.*f %12.*f %12.*f %s", angles.decimals, x, angles.decimals, y,
                  angles.decimals, z, angles.name);
  };
  text += "rpy       " + row(rpy.x(), rpy.y(), rpy.z()) + "\n";
  const bool complete = X_AB.covariance.complete();
  if (!complete) {
    text += "std dev   " + shortened(unspecified_text(X_AB.basis.unspecified), room(70)) + "\n";
  }
  if (!assumed.empty()) text += "assumed   " + shortened(assumed_text(assumed), room(70)) + "\n";
  text += (complete ? "std dev   " : "of others ") +
          format("%12.6f %12.6f %12.6f m   %s\n", s[0], s[1], s[2], kAxesOfTranslation);
  const double unit = angles.per_radian;
  text += "          " + row(s[3] * unit, s[4] * unit, s[5] * unit) + " " + kAxesOfRotation + "\n";
  return text + "age       " + (X_AB.stamp ? ago(*X_AB.stamp, now) : "none (static)") + "\n";
}

namespace {

struct Echo final : RecordableCommand {
  explicit Echo(CLI::App& app) {
    until_interrupted = true;
    path.add_ends(app);
    add_watch_options(app, options);
    add_recording(app);
    explain_angles(app);
  }

  int ask(Client& client, const Common& common) const override {
    Screen screen;
    return follow(client, common, path, options, [&](const StampedTransform& X_AB) {
      show(client, common, X_AB, screen, [&] { return present(client, common, path.a, path.b); });
    });
  }

  int ask_recording(Recording& recorded, const Common& common) const override {
    const auto from = beginning(recorded, at);
    if (!from) return report(from.error(), common);
    const Time end = recorded.summary().end.value_or(Time{});
    const std::chrono::nanoseconds period(std::llround(1e9 / options.rate));
    Screen screen;
    for (Time now = *from; now <= end; now += period) {
      recorded.seek(now);
      const auto X_AB = recorded.lookup(path.a, path.b);
      if (X_AB) {
        show(Source(recorded), common, *X_AB, screen, [&] { return now; });
      } else {
        (void)report(X_AB.error(), common);
      }
      // People watch it in the time of the recording, programs read it at once.
      if (!common.json && interrupted_within(1.0 / options.rate)) break;
    }
    return kDone;
  }

  template <class Now>
  void show(Source source, const Common& common, const StampedTransform& X_AB, Screen& screen,
            Now now) const {
    if (common.json) {
      (void)path.print(source, common, X_AB);
    } else {
      const auto joints = assumed_joints(source, path.a, path.b, X_AB.basis.unspecified);
      screen.redraw(echo_lines(path.a, path.b, X_AB, now(), common.angles, joints));
    }
  }

  Path path;
  WatchOptions options;
};

}  // namespace

void add_echo(Commands& commands) {
  commands.add<Echo>("echo", "follow a path on one page: position, angles, deviations, age",
                     "echo world hand_left");
}

}  // namespace tfdude::cli
