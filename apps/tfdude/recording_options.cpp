#include "recording_options.hpp"

#include "tfdude/recording/recording.hpp"

namespace tfdude::cli {
namespace {

// In its own domain unless another one is given, so that nobody takes a replay for the robot.
constexpr std::uint32_t kReplayDomain = 77;

void add_file(CLI::App* command, Arguments& arguments) {
  command->add_option("FILE", arguments.recording.file, "the recording, an MCAP file")
      ->type_name("FILE")
      ->required();
}

}  // namespace

void add_recorded(CLI::App* command, Arguments& arguments, LocalCommand& local,
                  RecordingCommand run) {
  auto* option = command->add_option_function<std::string>(
      "--recording",
      [&arguments, &local, run = std::move(run)](const std::string& file) {
        arguments.recording.file = file;
        local = [run](const Arguments& given) {
          auto recording = Recording::open(given.recording.file);
          if (!recording) return report(recording.error(), given);
          return run(*recording, given);
        };
      },
      "ask this file of tfdude record instead of the live system");
  option->type_name("FILE");
  if (command->get_option_no_throw("--at") != nullptr) return;
  add_stamp(command, "--at", arguments.stamp,
            "with --recording, the instant: seconds since the epoch or, negative, before its end")
      ->needs(option);
}

void add_recording(CLI::App* command, Arguments& arguments, LocalCommand& local, Question ask) {
  add_recorded(command, arguments, local,
               [ask = std::move(ask)](Recording& recording, const Arguments& given) {
                 const Source source(recording);
                 const auto at = optional_stamp(source, given.stamp);
                 if (!at) return report(at.error(), given);
                 if (*at) recording.seek(**at);
                 return ask(source, given);
               });
}

void add_recording_commands(CLI::App& app, Arguments& arguments, Command& chosen,
                            LocalCommand& local) {
  RecordingArguments& given = arguments.recording;
  auto* record = add_command(app, "record", "record all partitions, until interrupted",
                             "record robot.mcap", run_record, chosen);
  add_file(record, arguments);
  record->add_option("--split-size", given.split_mb, "begin another file after so many megabytes")
      ->type_name("MB")
      ->check(within(1, 1e9, "1 to 1e9"));
  record->add_option("--split-time", given.split_s, "begin another file after so many seconds")
      ->type_name("SECONDS")
      ->check(within(1, 1e9, "1 to 1e9"));
  record->add_flag("--raw", given.raw, "do not compress");
  auto* info = add_command(app, "info", "what a recording contains, and what is wrong with it",
                           "info robot.mcap", [&local] { local = run_info; });
  add_file(info, arguments);
  auto* replay =
      add_command(app, "replay", "serve the partitions of a recording again, in domain 77",
                  "replay robot.mcap --rate 0.5", [&local] { local = run_replay; });
  add_file(replay, arguments);
  replay->add_option("--rate", given.rate, "how many times as fast")
      ->check(within(0.001, 1000, "0.001 to 1000"));
  add_stamp(replay, "--at", arguments.stamp,
            "where to begin: seconds since the epoch or, negative, before the end");
  replay->add_flag("--loop", given.loop, "begin again at the end");
  replay->add_flag("--paused", given.paused, "begin paused; a space on standard input goes on");
  replay->parse_complete_callback([&app, &arguments] {
    if (app.count("--domain") == 0) arguments.options.domain = kReplayDomain;
  });
}

}  // namespace tfdude::cli
