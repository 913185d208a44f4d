#pragma once

#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "commands.hpp"

// What several commands need to describe themselves to CLI11.
namespace tfdude::cli {

/// A command that asks or changes the live system. @return the exit status, or kNeedsAllFrames
using Command = std::function<int(Client&, const Arguments&)>;

/// Adds a command with an example, after "tfdude ", that calls a function if it is given.
CLI::App* add_command(CLI::App& app, const char* name, const char* help, const char* example,
                      const std::function<void()>& choose);

/// The same, for a command that is chosen then.
CLI::App* add_command(CLI::App& app, const char* name, const char* help, const char* example,
                      Command run, Command& chosen);

/// Adds the frame, or the two frames, that a command is about.
void add_id(CLI::App* command, Arguments& arguments);
void add_ends(CLI::App* command, Arguments& arguments);

/// Adds an option for a stamp, see parse_stamp().
CLI::Option* add_stamp(CLI::App* command, const char* name, std::string& stamp, const char* help);

/// The same for the stamp that makes a value a sample, and for the instant of a question.
void add_sample_stamp(CLI::App* command, Arguments& arguments);
void add_instant(CLI::App* command, Arguments& arguments);

/// Adds the order of covariance propagation.
void add_order(CLI::App* command, Arguments& arguments);

/// Checks that a number is within a range, which the message names as `range`. CLI::Range would
/// accept NaN.
std::function<std::string(const std::string&)> within(double least, double most, const char* range);

/// Adds the options for a pose and its covariance.
void add_pose_options(CLI::App& command, Arguments& arguments);

/// Says in the help which unit angles have.
void explain_angles(CLI::App& command);

/// Adds the option for the file of a picture, whose name must end in one of these.
void add_out(CLI::App* command, Arguments& arguments, const std::vector<std::string>& endings);

}  // namespace tfdude::cli
