#pragma once

#include <string>
#include <tinyxml2.h>

#include "tfdude/base/result.hpp"

namespace tfdude {

/// Parses the text of an XML file in time that its length bounds.
/// @param file  for messages
/// @return its only element, null if there is none; kConfig naming file and line: empty, not XML;
///   kTooMuch: more attributes than any file has
[[nodiscard]] Result<const tinyxml2::XMLElement*> parse_xml(tinyxml2::XMLDocument& document,
                                                            const std::string& text,
                                                            const std::string& file);

}  // namespace tfdude
