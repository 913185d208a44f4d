#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "command.hpp"

// How commands print answers and errors. The functions that return an int return the exit status.
namespace tfdude::cli {

/// Prints an answer as JSON or as text.
int answer(const Common& common, const nlohmann::json& json, const std::string& text);
/// Prints a list of ids, one per line.
int answer_list(const Common& common, const char* key, const std::vector<std::string>& ids);
/// Prints that the command changed its frame or partition, or why it did not.
int answer_done(Client& client, const Common& common, const Result<void>& changed, const char* what,
                const std::string& id);

/// Prints an error of the command line as JSON.
int report_usage(const std::string& message);
/// Prints an error.
int report(const Error& error, const Common& common);
/// Prints why a request failed. @return also kNeedsAllFrames
int report_cause(Source source, const Error& error, const Common& common);
/// Why a request failed: with an unknown frame, it may be that no partition answers.
[[nodiscard]] Error cause_of(Source source, const Error& error, const Common& common);
/// The same with what was probably meant: a name that is nearly the one that nobody has, the frame
/// that a joint moves, or no instant instead of 0. May ask others.
[[nodiscard]] Error with_hint(Source source, Error error, const Common& common);
/// An answer in which nothing was found counts as an error if there is no partition. It is printed.
[[nodiscard]] int check_partitions(Source source, const Common& common, bool found);

/// "the built-in profile", or which one.
[[nodiscard]] std::string profile_of(const Options& options);
/// That no partition answers, and what may be the cause.
[[nodiscard]] std::string nobody_answers(const Common& common);
/// Prints it, and `more`, if there are none, or why they could not be asked for.
void warn_without(const Result<std::vector<PartitionInfo>>& partitions, const Common& common,
                  const char* more = "");

/// Waits between two outputs of a command that runs until interrupted.
/// @return whether it was interrupted
[[nodiscard]] bool interrupted_within(double seconds);

}  // namespace tfdude::cli
