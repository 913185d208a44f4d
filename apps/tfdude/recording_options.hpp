#pragma once

#include <functional>

#include "command_options.hpp"
#include "keys_commands.hpp"

namespace tfdude::cli {

/// A command that the live system or a recording can answer.
using Question = std::function<int(Source, const Arguments&)>;

/// Adds --recording, which asks a file instead of the live system, at the instant of --at, which is
/// added if the command does not have it.
void add_recording(CLI::App* command, Arguments& arguments, LocalCommand& local, Question ask);

/// The same for commands that go through a recording.
using RecordingCommand = std::function<int(Recording&, const Arguments&)>;
void add_recorded(CLI::App* command, Arguments& arguments, LocalCommand& local,
                  RecordingCommand run);

/// Adds the commands that record, replay, and describe a recording.
void add_recording_commands(CLI::App& app, Arguments& arguments, Command& chosen,
                            LocalCommand& local);

int run_record(Client& client, const Arguments& arguments);
int run_info(const Arguments& arguments);
int run_replay(const Arguments& arguments);
/// `echo` and `events` from --at on; default: from the beginning.
int run_recorded_echo(Recording& recording, const Arguments& arguments);
int run_recorded_events(Recording& recording, const Arguments& arguments);

}  // namespace tfdude::cli
