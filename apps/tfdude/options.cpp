#include "options.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "tfdude/base/id.hpp"

#include "../numbers.hpp"
#include "../rendering/text.hpp"
#include "stamps.hpp"

namespace tfdude::cli {

CLI::Option* add_stamp(CLI::App& app, const char* name, std::string& stamp, const char* help) {
  return app.add_option(name, stamp, help)
      ->type_name("SECONDS")
      ->check([](const std::string& text) {
        const auto parsed = parse_stamp(text, Time(std::chrono::seconds(INT32_MAX)));
        return parsed ? std::string() : parsed.error().message;
      });
}

void add_sample_stamp(CLI::App& app, std::string& stamp) {
  add_stamp(app, "--stamp", stamp,
            "make it a sample of this instant: seconds since the epoch or, negative, before now");
}

void add_instant(CLI::App& app, std::string& at) {
  add_stamp(app, "--at", at, "the instant: seconds since the epoch or, negative, before now");
}

void add_rate(CLI::App& app, double& rate, const char* help) {
  app.add_option("--rate", rate, help)->check(within(0.001, 1000, "0.001 to 1000"));
}

void add_order(CLI::App& app, int& order) {
  app.add_option("--order", order, "order of covariance propagation: 2 or 4")
      ->check([](const std::string& text) {
        return text == "2" || text == "4" ? std::string() : "'" + text + "' is neither 2 nor 4";
      });
}

CLI::Option* add_watch(CLI::App& app, Command& command, bool& watch) {
  return app.add_flag_callback(
      "--watch", [&command, &watch] { command.until_interrupted = watch = true; },
      "redraw it twice a second, until interrupted");
}

std::function<std::string(const std::string&)> within(double least, double most,
                                                      const char* range) {
  return [=](const std::string& text) {
    const auto value = to_number(text);
    return value && *value >= least && *value <= most ? "" : text + " is not within " + range;
  };
}

void add_pose(CLI::App& app, TransformSpec& spec) {
  app.add_option("--xyz", spec.xyz, "translation [m]")->type_name("X Y Z");
  auto* rpy = app.add_option("--rpy", spec.rpy, "rotation about fixed axes X, Y, Z [rad]");
  rpy->type_name("R P Y");
  auto* quat = app.add_option("--quat", spec.quat, "rotation as unit quaternion");
  quat->type_name("X Y Z W")->excludes(rpy);
  app.add_option("--matrix", spec.matrix, "the pose as homogeneous 4x4 matrix row by row")
      ->type_name("16 NUMBERS")
      ->excludes("--xyz")
      ->excludes(rpy)
      ->excludes(quat);
  app.add_option(
         "--geodetic", spec.geodetic,
         "place in an earth frame, latitude and longitude [deg], altitude [m]; the rotation "
         "is that to east, north and up")
      ->type_name("LAT LON ALT")
      ->excludes("--xyz")
      ->excludes("--matrix");
  add_covariance(app, spec);
}

void add_covariance(CLI::App& app, TransformSpec& spec) {
  auto* stddev = app.add_option("--stddev", spec.stddev, "standard deviations [m m m rad rad rad]")
                     ->type_name("6 NUMBERS");
  explain_angles(app);
  app.add_option("--cov", spec.cov, "upper triangle of the covariance row by row")
      ->type_name("21 NUMBERS")
      ->excludes(stddev);
  app.add_option("--covariance", spec.covariance, "instead of numbers: unspecified or exact")
      ->check(CLI::IsMember({"unspecified", "exact"}))
      ->excludes(stddev);
}

Result<Transform> typed_pose(const TransformSpec& spec, const Common& common,
                             const std::string& id) {
  auto X_PC = in_radians(spec, common.angles).build();
  if (!X_PC) return fail_at("frame " + quote(id), X_PC.error());
  return X_PC;
}

Result<PartialTransform> typed_parts(const TransformSpec& spec, const Common& common,
                                     const std::string& id) {
  const auto X_PC = typed_pose(spec, common, id);
  if (!X_PC) return tl::unexpected(X_PC.error());
  PartialTransform given;
  if (spec.gives_translation()) given.translation = X_PC->pose.translation();
  if (spec.gives_rotation()) given.rotation = X_PC->pose.rotation();
  if (spec.gives_covariance()) given.covariance = X_PC->covariance;
  return given;
}

void add_recording_file(CLI::App& app, std::string& file) {
  app.add_option("FILE", file, "the recording, an MCAP file")->type_name("FILE")->required();
}

void explain_angles(CLI::App& app) {
  app.footer(
      "Angles are in radians; with --deg in degrees, typed and printed. Answers in JSON have "
      "radians.\n" +
      app.get_footer());
}

void add_out(CLI::App& app, std::string& file, const std::vector<std::string>& endings) {
  const std::string all = joined(endings);
  app.add_option("--out", file, "the picture's file: " + all)
      ->type_name("FILE")
      ->required()
      ->check([endings, all](const std::string& typed) {
        const auto dot = typed.rfind('.');
        const std::string ending = dot == std::string::npos ? "" : typed.substr(dot);
        const bool known = std::find(endings.begin(), endings.end(), ending) != endings.end();
        return known ? "" : quote(typed) + " does not end in one of " + all;
      });
}

}  // namespace tfdude::cli
