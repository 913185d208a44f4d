#pragma once

#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "tfdude/types/options.hpp"

namespace tfdude::cli {

/// What may stand at a place of the command line.
enum class Completed {
  kNothing,  ///< or text that nobody can guess
  kWords,    ///< commands, options, or one of some words
  kFrames,
  kPartitions,
  kJoints,
  kFiles,
  kDirectories,
};

/// A word that may stand there, and what it means.
struct Candidate {
  std::string word;
  std::string help;
};

struct Completion {
  Completed kind = Completed::kNothing;
  std::vector<Candidate> words{};  ///< of kWords, in the order of the help
};

/// What may stand after these words, as the options and commands of the program say.
/// @param begun  the beginning of the word that is completed: options begin with '-'
[[nodiscard]] Completion completion_after(CLI::App& app, const std::vector<std::string>& words,
                                          const std::string& begun);

/// Runs the hidden command `__complete [WORD]... BEGUN`, for the shells: prints each word that may
/// stand there and begins like this, one per line, after a tab what it means; ":files" or
/// ":directories" if the shell should complete these. Asks the live system for names, for at most
/// kCompletionTime in all. Ends the process, with status 0.
[[noreturn]] void complete(CLI::App& app, const std::vector<std::string>& words);

inline constexpr Milliseconds kCompletionTime{130};

}  // namespace tfdude::cli
