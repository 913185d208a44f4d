#include "command_options.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "tfdude/base/id.hpp"

namespace tfdude::cli {

CLI::App* add_command(CLI::App& app, const char* name, const char* help, const char* example,
                      const std::function<void()>& choose) {
  CLI::App* command = app.add_subcommand(name, help);
  command->footer(std::string("Example: tfdude ") + example);
  command->callback(choose);
  return command;
}

CLI::App* add_command(CLI::App& app, const char* name, const char* help, const char* example,
                      Command run, Command& chosen) {
  return add_command(app, name, help, example, [&chosen, run = std::move(run)] { chosen = run; });
}

void add_id(CLI::App* command, Arguments& arguments) {
  command->add_option("ID", arguments.id, "the frame")->required();
}

void add_ends(CLI::App* command, Arguments& arguments) {
  command->add_option("A", arguments.id, "the reference frame")->required();
  command->add_option("B", arguments.other, "the frame seen from A")->required();
}

CLI::Option* add_stamp(CLI::App* command, const char* name, std::string& stamp, const char* help) {
  return command->add_option(name, stamp, help)
      ->type_name("SECONDS")
      ->check([](const std::string& text) {
        const auto parsed = parse_stamp(text, Time(std::chrono::seconds(INT32_MAX)));
        return parsed ? std::string() : parsed.error().message;
      });
}

void add_sample_stamp(CLI::App* command, Arguments& arguments) {
  add_stamp(command, "--stamp", arguments.stamp,
            "make it a sample of this instant: seconds since the epoch or, negative, before now");
}

void add_instant(CLI::App* command, Arguments& arguments) {
  add_stamp(command, "--at", arguments.stamp,
            "the instant: seconds since the epoch or, negative, before now");
}

void add_order(CLI::App* command, Arguments& arguments) {
  command->add_option("--order", arguments.order, "order of covariance propagation: 2 or 4")
      ->check(CLI::IsMember({2, 4}));
}

std::function<std::string(const std::string&)> within(double least, double most,
                                                      const char* range) {
  return [=](const std::string& text) {
    const double value = std::strtod(text.c_str(), nullptr);
    return value >= least && value <= most ? "" : text + " is not within " + range;
  };
}

void add_pose_options(CLI::App& command, Arguments& arguments) {
  auto& spec = arguments.spec;
  command.add_option("--xyz", spec.xyz, "translation [m]")->type_name("X Y Z");
  auto* rpy = command.add_option("--rpy", spec.rpy, "rotation about fixed axes X, Y, Z [rad]");
  rpy->type_name("R P Y");
  auto* quat = command.add_option("--quat", spec.quat, "rotation as unit quaternion");
  quat->type_name("X Y Z W")->excludes(rpy);
  command.add_option("--matrix", spec.matrix, "the pose as homogeneous 4x4 matrix row by row")
      ->type_name("16 NUMBERS")
      ->excludes("--xyz")
      ->excludes(rpy)
      ->excludes(quat);
  auto* stddev =
      command.add_option("--stddev", spec.stddev, "standard deviations [m m m rad rad rad]")
          ->type_name("6 NUMBERS");
  explain_angles(command);
  command.add_option("--cov", spec.cov, "upper triangle of the covariance row by row")
      ->type_name("21 NUMBERS")
      ->excludes(stddev);
  command.add_option("--covariance", spec.covariance, "instead of numbers: unspecified or exact")
      ->check(CLI::IsMember({"unspecified", "exact"}))
      ->excludes(stddev);
}

void explain_angles(CLI::App& command) {
  command.footer(
      "Angles are in radians; with --deg in degrees, typed and printed. Answers in JSON have "
      "radians.\n" +
      command.get_footer());
}

void add_out(CLI::App* command, Arguments& arguments, const std::vector<std::string>& endings) {
  std::string all;
  for (const std::string& ending : endings) all += (all.empty() ? "" : ", ") + ending;
  command->add_option("--out", arguments.out, "the picture's file: " + all)
      ->type_name("FILE")
      ->required()
      ->check([endings, all](const std::string& file) {
        const auto dot = file.rfind('.');
        const std::string ending = dot == std::string::npos ? "" : file.substr(dot);
        const bool known = std::find(endings.begin(), endings.end(), ending) != endings.end();
        return known ? "" : quote(file) + " does not end in one of " + all;
      });
}

}  // namespace tfdude::cli
