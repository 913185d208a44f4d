#pragma once

#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "tfdude/math/transform_spec.hpp"

#include "command.hpp"

// Options that several commands have.
namespace tfdude::cli {

/// A command about one frame.
struct FrameCommand : LiveCommand {
  explicit FrameCommand(CLI::App& app) { app.add_option("ID", id, "the frame")->required(); }

  std::string id;
};

/// A command that takes no arguments.
struct PlainCommand : LiveCommand {
  explicit PlainCommand(CLI::App& /*app*/) {}
};

/// Adds an option for a stamp, see parse_stamp().
CLI::Option* add_stamp(CLI::App& app, const char* name, std::string& stamp, const char* help);
/// The same for the stamp that makes a value a sample, and for the instant of a question.
void add_sample_stamp(CLI::App& app, std::string& stamp);
void add_instant(CLI::App& app, std::string& at);

/// How often a page is redrawn [Hz], by default.
inline constexpr double kRedrawRate = 2;
/// Adds a rate of output [Hz].
void add_rate(CLI::App& app, double& rate, const char* help);
/// Adds the order of covariance propagation: 2 or 4.
void add_order(CLI::App& app, int& order);
/// Adds --watch, with which the command runs until interrupted.
CLI::Option* add_watch(CLI::App& app, Command& command, bool& watch);

/// Checks that a number is within a range, which the message names as `range`. CLI::Range would
/// accept NaN.
std::function<std::string(const std::string&)> within(double least, double most, const char* range);

/// Adds the options for a pose and its covariance.
void add_pose(CLI::App& app, TransformSpec& spec);
/// Those for the covariance alone.
void add_covariance(CLI::App& app, TransformSpec& spec);
/// The pose as typed. @return kInvalidInput naming the frame, and what is wrong with its pose
[[nodiscard]] Result<Transform> typed_pose(const TransformSpec& spec, const Common& common,
                                           const std::string& id);
/// Those parts of it that were typed.
[[nodiscard]] Result<PartialTransform> typed_parts(const TransformSpec& spec, const Common& common,
                                                   const std::string& id);

/// Adds the file of a recording.
void add_recording_file(CLI::App& app, std::string& file);

/// Says in the help which unit angles have.
void explain_angles(CLI::App& app);

/// Adds the option for the file of a picture, whose name must end in one of these.
void add_out(CLI::App& app, std::string& file, const std::vector<std::string>& endings);

}  // namespace tfdude::cli
