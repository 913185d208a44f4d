#pragma once

#include <string>

#include "tfdude/base/result.hpp"

namespace tfdude::fastdds {

/// A file of profiles whose names are its own. Fast DDS keeps profiles and transports by name for the whole process, the
/// first of each name: so each file's names get an ending that no other file's have.
///
/// What is not a profile (settings of the log or of the library, types) is taken out, and so is the mark of default
/// profiles: they would hold for everybody in the process.
/// @param ending  appended to the names of profiles and of transports described there
/// @return kConfig: not well-formed XML, or without profiles.
[[nodiscard]] Result<std::string> with_own_names(const std::string& xml, const std::string& ending);

}  // namespace tfdude::fastdds
