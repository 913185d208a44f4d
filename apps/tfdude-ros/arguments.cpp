#include "arguments.hpp"

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "tfdude/types/version.hpp"

#include "../network_options.hpp"
#include "../numbers.hpp"

namespace tfdude::ros {
namespace {

std::string variable(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): no other threads yet
  return value == nullptr ? std::string() : std::string(value);
}

}  // namespace

std::optional<int> read_arguments(int argc, char** argv, Settings& settings) {
  if (const auto read = read_environment(variable, settings); !read) {
    std::fprintf(stderr, "tfdude-ros: %s\n", read.error().message.c_str());
    return kWrongUsage;
  }
  CLI::App app{"tfdude-ros: connects the frames of ROS 2 and of tf-dude"};
  app.footer("Example: tfdude-ros --domain 7 --ros-domain 0");
  app.set_version_flag("--version", version_line());
  app.add_option("--partition", settings.partition, "partition for the frames of /tf")
      ->capture_default_str();
  app.add_option("--ros-domain", settings.ros_domain,
                 "ROS domain, 0 to 232 (else $ROS_DOMAIN_ID, else 0)")
      ->check(CLI::Range(0, 232));
  std::vector<std::string> exported;
  app.add_option("--export", exported,
                 "send the frames of this partition to /tf; '*' stands for any characters; may be "
                 "repeated")
      ->allow_extra_args(false);
  std::vector<std::string> exported_frames;
  app.add_option("--export-frame", exported_frames, "the same for single frames")
      ->allow_extra_args(false);
  double rate = ExportSettings().rate;
  app.add_option("--rate", rate,
                 "send an edge to /tf at most so many times a second [Hz]; 0: every sample")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e6));
  cli::add_network_options(app, settings.options);
  cli::require_numbers(app);
  try {
    app.name(argv[0]);
    app.parse(cli::arguments_of(argc, argv));
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kWrongUsage;
  }
  if (!exported.empty() || !exported_frames.empty()) {
    settings.frames_out.emplace();
    settings.frames_out->partitions = Patterns(std::move(exported));
    settings.frames_out->frames = Patterns(std::move(exported_frames));
    settings.frames_out->rate = rate;
  }
  return std::nullopt;
}

}  // namespace tfdude::ros
