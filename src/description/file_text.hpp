#pragma once

#include <string>

#include "tfdude/base/result.hpp"

namespace tfdude {

/// What may be read: a pipe waits for its writer, so it is for programs that a signal still ends.
enum class Readable { kAnything, kRegularFile };

/// Reads a whole file of at most 64 MiB. That is room for half a million frames, and also stops
/// reading /dev/zero. A byte order mark of UTF-8 at its begin is left out.
/// @return kConfig naming the file: missing, a directory, not readable, too long, no regular file
[[nodiscard]] Result<std::string> read_text(const std::string& path,
                                            Readable readable = Readable::kAnything);

/// An error about a place in a file: "arm.urdf:12: message". @param line  zero if unknown
[[nodiscard]] tl::unexpected<Error> file_error(Errc code, const std::string& file, int line,
                                               const std::string& message);

}  // namespace tfdude
