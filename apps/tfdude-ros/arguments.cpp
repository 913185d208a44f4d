#include "arguments.hpp"

#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "tfdude/base/id.hpp"
#include "tfdude/types/version.hpp"

#include "../command_line.hpp"
#include "../environment.hpp"
#include "../network_options.hpp"
#include "config/config.hpp"

namespace tfdude::ros {
namespace {

// The options that say the same as the configuration, and have priority over it.
class CommandLine {
 public:
  explicit CommandLine(CLI::App& app) {
    app.add_option("--config", config_, "YAML file; the options below have priority");
    partition_ = app.add_option("--partition", given_.partition,
                                "the partition of the frames of /tf (default: ros)");
    domain_ = app.add_option("--ros-domain", given_.ros_domain,
                             "ROS domain, 0 to 232 (else $ROS_DOMAIN_ID, else 0)")
                  ->check(CLI::Range(0, 232));
    app.add_flag("--no-tf-in", no_tf_in_, "do not read /tf and /tf_static");
    app.add_option("--export", partitions_,
                   "send the frames of this partition to /tf; '*' stands for any characters; may "
                   "be repeated")
        ->allow_extra_args(false);
    app.add_option("--export-frame", frames_, "the same for single frames")
        ->allow_extra_args(false);
    rate_ = app.add_option("--rate", out_.rate,
                           "send an edge at most so many times a second [Hz]; 0: every sample")
                ->capture_default_str()
                ->check(CLI::Range(0.0, 1e6));
    joints_ = app.add_option("--joints", stddev_,
                             "pass on the joints of /joint_states, with this standard deviation "
                             "[rad or m]; without one it is unspecified")
                  ->expected(0, 1)
                  ->check(CLI::Range(0.0, 1e9));
    app.add_flag("--description", description_,
                 "serve the robot of /robot_description as the partition 'robot'");
    described_ =
        app.add_option("--publish-description", out_of_,
                       "publish the URDF of this partition's daemon on /robot_description");
    clock_ =
        app.add_option("--clock", clock_kind_,
                       "the clock of stamps: system, external (as the option of all programs), "
                       "or ros: an external one that this program sets by /clock")
            ->check(CLI::IsMember({"system", "external", "ros"}));
    prefix_ = app.add_option("--prefix", text_, "what all names here have before those of ROS");
  }

  /// @return the errors of load_config()
  [[nodiscard]] Result<void> apply(Settings& settings) {
    if (!config_.empty()) {
      if (auto loaded = load_config(config_, settings); !loaded) return loaded;
    }
    if (partition_->count() > 0) settings.partition = given_.partition;
    if (domain_->count() > 0) settings.ros_domain = given_.ros_domain;
    if (no_tf_in_) settings.frames_in.reset();
    apply_exports(settings);
    if (joints_->count() > 0) {
      if (!settings.joints_in) settings.joints_in.emplace();
      if (stddev_) settings.joints_in->stddev = stddev_;
    }
    if (description_ && !settings.description_in) settings.description_in.emplace();
    if (described_->count() > 0) {
      if (auto ok = check_partition_name(out_of_); !ok) return ok;
      settings.description_out = DescriptionOutSettings{{}, out_of_};
    }
    if (clock_->count() > 0) {
      settings.passes_clock = clock_kind_ == "ros";
      settings.options.clock = clock_kind_ == "system" ? ClockKind::kSystem : ClockKind::kExternal;
    }
    if (prefix_->count() > 0) set_prefix(text_, settings);
    return check_partitions(settings);
  }

 private:
  void apply_exports(Settings& settings) {
    if (!partitions_.empty() || !frames_.empty()) {
      if (!settings.frames_out) settings.frames_out.emplace();
      settings.frames_out->partitions = Patterns(std::move(partitions_));
      settings.frames_out->frames = Patterns(std::move(frames_));
    }
    if (rate_->count() > 0 && settings.frames_out) settings.frames_out->rate = out_.rate;
  }

  Settings given_;
  ExportSettings out_;
  std::string config_;
  std::string text_;
  std::string clock_kind_;
  std::string out_of_;
  std::vector<std::string> partitions_;
  std::vector<std::string> frames_;
  std::optional<double> stddev_;
  bool no_tf_in_ = false;
  bool description_ = false;
  CLI::Option* partition_;
  CLI::Option* domain_;
  CLI::Option* rate_;
  CLI::Option* joints_;
  CLI::Option* described_;
  CLI::Option* clock_;
  CLI::Option* prefix_;
};

}  // namespace

std::optional<int> read_arguments(int argc, char** argv, Settings& settings) {
  CLI::App app{"tfdude-ros: connects the frames, joints and robots of ROS 2 and of tf-dude"};
  app.footer(
      "Exit status: 0 stopped by a signal, 1 the partition is served by another process, or DDS "
      "cannot start, 2 wrong usage or configuration.\n"
      "Example: tfdude-ros --domain 7 --ros-domain 0 --export arm");
  app.set_version_flag("--version", version_line());
  CommandLine command_line(app);
  cli::add_network_options(app, settings.options);
  if (const auto status = cli::read_command_line(app, argc, argv)) return status;
  auto read = read_environment(cli::environment, settings);
  if (read) read = command_line.apply(settings);
  if (read) return std::nullopt;
  std::fprintf(stderr, "tfdude-ros: %s\n", read.error().message.c_str());
  return cli::kWrongUsage;
}

}  // namespace tfdude::ros
