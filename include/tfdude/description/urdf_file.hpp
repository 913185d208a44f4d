#pragma once

#include <string>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"

namespace tfdude {

/// The text of a URDF, for readers of what load_urdf() ignores, such as shapes: at most 64 MiB, and
/// XML that TinyXML parses in time that its length bounds.
/// @return kConfig naming the file and line: a missing file, not XML, not a URDF; kTooMuch: an
///   element has more attributes than any URDF
[[nodiscard]] TFDUDE_EXPORT Result<std::string> load_urdf_text(const std::string& file);

}  // namespace tfdude
