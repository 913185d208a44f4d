#include "arguments.hpp"

#include <cstdio>
#include <cstdlib>
#include <map>

#include <CLI/CLI.hpp>

#include "tfdude/math/transform_spec.hpp"
#include "tfdude/types/version.hpp"

#include "../command_line.hpp"
#include "../network_options.hpp"

namespace tfdude::daemon {
namespace {

// The directory by the XDG base directory specification. @return empty if there is no home
// NOLINTBEGIN(concurrency-mt-unsafe): there are no other threads yet
std::string default_state() {
  const char* state = std::getenv("XDG_STATE_HOME");
  if (state != nullptr && *state == '/') return std::string(state) + "/tfdude";
  const char* home = std::getenv("HOME");
  return home != nullptr && *home != 0 ? std::string(home) + "/.local/state/tfdude" : std::string();
}
// NOLINTEND(concurrency-mt-unsafe)

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == ',') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

// Options that may be repeated; each applies to the --urdf before it.
class UrdfOptions {
 public:
  explicit UrdfOptions(CLI::App& app) : app_(app) {
    file_ = add("--urdf",
                "URDF file of a robot; may be repeated. --root, --prefix, --links and "
                "--strict-limits apply to the --urdf before them");
    root_ = add("--root", "parent frame of the robot's root link");
    prefix_ = add("--prefix", "prefix of the names of all its links and joints");
    links_ = add("--links", "LINK or FROM..TO[..TO], separated by commas: these links only");
    strict_ = app.add_flag("--strict-limits", "reject positions outside the joints' limits")
                  ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  }

  // @throws CLI::ParseError if an option comes before any --urdf, or is given twice for one
  [[nodiscard]] std::vector<UrdfPart> parts() const {
    std::vector<UrdfPart> parts;
    std::map<const CLI::Option*, std::size_t> used;
    std::map<const CLI::Option*, std::size_t> set_for;
    for (const CLI::Option* option : app_.parse_order()) {
      if (option != file_ && option != root_ && option != prefix_ && option != links_ &&
          option != strict_) {
        continue;
      }
      const std::string& value = option->results().at(used[option]++);
      if (option == file_) {
        parts.push_back({value, {}, {}, {}, {}, false, {}});
        continue;
      }
      if (parts.empty()) throw CLI::ValidationError(option->get_name(), "comes before any --urdf");
      if (set_for[option] == parts.size()) {
        throw CLI::ValidationError(option->get_name(), "is given twice for " + parts.back().file);
      }
      set_for[option] = parts.size();
      set(parts.back(), option, value);
    }
    return parts;
  }

 private:
  CLI::Option* add(const std::string& name, const std::string& help) {
    return app_.add_option(name, values_[name], help)->allow_extra_args(false);
  }

  void set(UrdfPart& part, const CLI::Option* option, const std::string& value) const {
    if (option == root_) part.root = value;
    if (option == prefix_) part.prefix = value;
    if (option == links_) part.links = split(value);
    if (option == strict_) part.strict_limits = value == "true";
  }

  CLI::App& app_;
  std::map<std::string, std::vector<std::string>> values_;
  CLI::Option* file_;
  CLI::Option* root_;
  CLI::Option* prefix_;
  CLI::Option* links_;
  CLI::Option* strict_;
};

// @throws CLI::ParseError if there are several, and options that are only for one
void set_configs(const std::vector<std::string>& configs, Arguments& arguments) {
  if (!configs.empty()) arguments.config = configs.front();
  if (configs.size() < 2) return;
  arguments.further.assign(configs.begin() + 1, configs.end());
  if (!arguments.check) throw CLI::ValidationError("--config", "is given twice without --check");
  if (!arguments.partition.empty() || !arguments.urdfs.empty() || !arguments.options.keys.empty()) {
    throw CLI::ValidationError("--config",
                               "is given twice with --partition, --urdf or --keys, which are "
                               "those of one daemon");
  }
}

}  // namespace

std::optional<int> read_arguments(int argc, char** argv, Arguments& arguments) {
  bool no_state = false;
  int save_every_ms = 1000;
  CLI::App app{"tfduded: owns a partition of the coordinate frames and serves it over DDS"};
  app.footer(
      "Exit status: 0 stopped by a signal, 1 the partition is served by another process, or DDS "
      "cannot start, 2 wrong usage, configuration or state, or configurations that contradict "
      "each other.\n"
      "Example: tfduded --partition arms --config examples/thesis/arms.yaml --domain 7");
  app.set_version_flag("--version", version_line());
  app.add_option("--partition", arguments.partition, "the partition's name");
  std::vector<std::string> configs;
  app.add_option("--config", configs, "YAML file of frames; with --check several, of all daemons");
  app.add_flag("--check", arguments.check,
               "check configuration, URDF, keys and stored state, print what would be served and "
               "what would change in the state, and write nothing; also whether several "
               "configurations fit together");
  const UrdfOptions urdfs(app);
  std::string covariance;
  auto* stated =
      app.add_option("--covariance", covariance,
                     "of all edges of --urdf that no joint moves: unspecified, or exact; "
                     "default: that of --config, or else unspecified");
  stated->check(CLI::IsMember({"unspecified", "exact"}));
  cli::add_network_options(app, arguments.options);
  cli::add_clock_option(app, [&](ClockKind kind) { arguments.clock = kind; });
  auto* state = app.add_option("--state", arguments.options.state,
                               "directory in which to keep the frames "
                               "(default: $XDG_STATE_HOME/tfdude or ~/.local/state/tfdude)");
  app.add_flag("--no-state", no_state, "store nothing: start from --config each time")
      ->excludes(state);
  app.add_flag(
      "--drop-damaged", arguments.drop_damaged,
      "leave out the frames and values of the stored state that are damaged, and name them");
  app.add_flag("--sync", arguments.options.sync,
               "acknowledged changes survive a power failure: each waits for the disk");
  app.add_option("--save-every", save_every_ms,
                 "shortest time between two stores of streamed values [ms]")
      ->check(CLI::Range(1, 86'400'000));
  PartitionLimits& limits = arguments.options.limits;
  constexpr std::size_t kMost = std::size_t{1} << 40U;
  app.add_option("--max-frames", limits.frames, "frames that requests can add up to")
      ->capture_default_str()
      ->check(CLI::Range(std::size_t{1}, kMost));
  app.add_option("--max-watches", limits.watches, "groups of watchers with different paths")
      ->capture_default_str()
      ->check(CLI::Range(std::size_t{1}, kMost));
  app.add_option("--max-history", limits.history_bytes, "memory of all histories [bytes]")
      ->capture_default_str()
      ->check(CLI::Range(std::size_t{1}, kMost));
  app.add_option("--max-others", arguments.options.others,
                 "frames, joints and removals of other partitions that are kept here")
      ->capture_default_str()
      ->check(CLI::Range(std::size_t{1}, kMost));
  const auto status = cli::read_command_line(
      app, argc, argv,
      {{"FILES",
        "The service tfduded@PARTITION of systemd reads /etc/tfdude/PARTITION.yaml and the "
        "variables in /etc/default/tfdude, and keeps its state in /var/lib/tfdude/PARTITION. "
        "The target tfdude.target stands for all of these services."}},
      [&] {
        arguments.urdfs = urdfs.parts();
        if (!covariance.empty() && arguments.urdfs.empty()) {
          throw CLI::ValidationError("--covariance",
                                     "needs --urdf; a configuration has the key "
                                     "covariance");
        }
        if (!covariance.empty()) arguments.covariance = *covariance_named(covariance);
        set_configs(configs, arguments);
      });
  if (status) return status;
  arguments.options.save_every = Milliseconds(save_every_ms);
  if (!arguments.options.state.empty() || no_state) return std::nullopt;
  arguments.options.state = default_state();
  if (!arguments.options.state.empty()) return std::nullopt;
  std::fputs("tfduded: no home directory: give --state DIR or --no-state\n", stderr);
  return cli::kWrongUsage;
}

}  // namespace tfdude::daemon
