#pragma once

#include <string>

#include "tfdude/base/result.hpp"

namespace tfdude::fastdds {

/// Makes the names in a file of profiles unique. Fast DDS keeps profiles and transports by name for
/// the whole process, the first of each name. So the names of each file get an ending that no other
/// file has.
///
/// Everything that is not a profile is removed (settings of the log or of the library, types), and
/// so is the mark of default profiles: they would be valid for the whole process.
/// @param ending  appended to the names of profiles and of transports described there
/// @return kConfig: not well-formed XML, or without profiles.
[[nodiscard]] Result<std::string> with_own_names(const std::string& xml, const std::string& ending);

/// One profile of such a file; that of a participant with the transports described there.
/// @param xml  well-formed, with the element "profiles" at the top
[[nodiscard]] std::string only_profile(const std::string& xml, const std::string& name);

}  // namespace tfdude::fastdds
