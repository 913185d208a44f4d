#pragma once

#include <string>
#include <vector>

#include "tfdude/base/result.hpp"

namespace tfdude {

/// The arguments with which a launch file in Python starts a program.
struct PythonArguments {
  std::vector<std::string> words;
  int line = 0;
};

/// Finds the calls that start static_transform_publisher, as in Node(executable='PROGRAM',
/// arguments=['1', 'map']), without running the file: arguments must be written as they are, in a
/// list, as 'text'.split() or as shlex.split('text').
/// @return kInvalidInput naming file and line: arguments that only Python could compute; a
///   condition or loop that decides about the call; a text that names the program elsewhere, and
///   that may start it; kConfig: a string or bracket without an end
[[nodiscard]] Result<std::vector<PythonArguments>> python_arguments(const std::string& text,
                                                                    const std::string& file);

}  // namespace tfdude
