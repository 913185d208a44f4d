#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "tfdude/client/client.hpp"

#include "../exit_status.hpp"
#include "../rendering/angles.hpp"
#include "source.hpp"

// Each command is a struct in a file of commands/: its constructor adds its options, and its member
// functions answer. commands.cpp lists all of them.
namespace tfdude::cli {

/// The options that all commands have.
struct Common {
  ClientOptions options;
  bool json = false;
  AngleUnit angles = kRadian;  ///< of angles that are typed, and of printed text
  char** argv = nullptr;       ///< the command line as it was typed
};

struct Command {
  Command() = default;
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;
  virtual ~Command() = default;

  /// Runs the command and prints its answer. @return the exit status
  [[nodiscard]] virtual int run(const Common& common) const = 0;

  /// The command ends when it is interrupted, so main() blocks the signals for that.
  bool until_interrupted = false;
};

/// Instead of an exit status, before anything was printed: all owners are of an earlier version,
/// and do not know the request for single frames (ClientOptions::follow). So the command must be
/// repeated by a client that receives all frames.
inline constexpr int kNeedsAllFrames = -1;

/// A command that asks or changes the live system.
struct LiveCommand : Command {
  [[nodiscard]] int run(const Common& common) const override;
  /// @return the exit status, or kNeedsAllFrames
  [[nodiscard]] virtual int ask(Client& client, const Common& common) const = 0;

  /// The command is about one or two frames, and asks for them instead of receiving all frames.
  bool single_frames = false;
};

/// A command that the live system or, with --recording, a recording can answer.
struct RecordableCommand : LiveCommand {
  /// Adds --recording, and --at if the command does not have it.
  void add_recording(CLI::App& app);

  [[nodiscard]] int run(const Common& common) const final;
  [[nodiscard]] virtual int ask_recording(Recording& recording, const Common& common) const = 0;

  std::string recording;
  std::string at;  ///< as typed, see parse_stamp()
};

/// A command that asks both in the same way, a recording at the instant of --at.
struct Question : RecordableCommand {
  [[nodiscard]] int ask(Client& client, const Common& common) const override;
  [[nodiscard]] int ask_recording(Recording& recording, const Common& common) const final;
  /// @return the exit status, or kNeedsAllFrames
  [[nodiscard]] virtual int ask_source(Source source, const Common& common) const = 0;
};

}  // namespace tfdude::cli
