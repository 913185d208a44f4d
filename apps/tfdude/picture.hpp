#pragma once

#include <map>
#include <string>

#include <nlohmann/json.hpp>

#include "command.hpp"
#include "program.hpp"

namespace tfdude::cli {

/// Writes a picture to a file, and prints the answer. @return the exit status
/// @param drawn  the picture, as text
/// @param programs  those that make others of it, by the ending of the file
int answer_picture(Source source, const Common& common, const std::string& file,
                   const std::string& drawn, const std::map<std::string, Program>& programs,
                   nlohmann::json json);

}  // namespace tfdude::cli
