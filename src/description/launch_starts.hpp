#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tfdude/base/result.hpp"

// What the readers of launch files share.
namespace tfdude {

inline constexpr const char* kStaticPublisher = "static_transform_publisher";

/// One start of the program.
struct LaunchStart {
  std::vector<std::string> words;  ///< its arguments
  bool of_tf = false;              ///< of the package tf, whose last argument is a period
  int line = 0;
};

/// Whether a word is the program, with or without its folder.
[[nodiscard]] bool is_publisher(std::string_view word);
/// Whether a text, or what a name is given in it, has the program as one of its words.
[[nodiscard]] bool mentions_publisher(std::string_view text);

/// What is said of a start that is not read, but would be lost beside others.
[[nodiscard]] std::string unread_start();

/// The words of arguments, as launch systems divide them: at blanks and ends of lines, with the
/// quotes and backslashes of a shell. @param line  of the text, for messages
/// @return kConfig naming file and line: a quote or an escape has no end
[[nodiscard]] Result<std::vector<std::string>> launch_words(std::string_view text,
                                                            const std::string& file, int line);

/// What is said of an argument that only the launch system, or the shell, could tell.
[[nodiscard]] std::string launch_substitution(const std::string& word);

/// Whether a condition holds. @param what  that depends on it, for the message
/// @return kInvalidInput naming file and line: only the launch system could tell
[[nodiscard]] Result<bool> launch_condition(std::string_view said, const std::string& what,
                                            const std::string& file, int line);

/// The starts in a launch file of ROS 2 in YAML, in the order of the file.
/// @return kConfig naming file and line: not YAML, no launch file; as launch_condition()
[[nodiscard]] Result<std::vector<LaunchStart>> starts_in_yaml(const std::string& text,
                                                              const std::string& name);

/// The starts that are commands of a shell script, in its order. Linear in its length.
/// @return kConfig naming file and line: a quote has no end; kInvalidInput: a start that a
///   condition or a loop decides about, with a substitution, or in a text that another program may
///   run
[[nodiscard]] Result<std::vector<LaunchStart>> starts_in_shell(const std::string& text,
                                                               const std::string& name);

}  // namespace tfdude
