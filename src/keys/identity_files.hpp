#pragma once

#include <string>

#include "tfdude/base/id.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/keys/key_files.hpp"

#include "description/file_text.hpp"
#include "keys/certificates.hpp"

namespace tfdude::keys {

/// The paths of the files of an identity.
[[nodiscard]] KeyFiles files_in(const std::string& directory);

/// The name in a certificate, whose subject is "NAME NUMBER". Each certificate has another number,
/// so nobody can use permissions with another certificate than the one that they were made for.
[[nodiscard]] std::string identity_of(const Certificate& certificate);

/// Reads a file, and then its text by a function. Errors name the file.
template <class Read>
[[nodiscard]] auto parse_file(const std::string& path, Read read) -> decltype(read(std::string())) {
  const auto text = read_text(path, Readable::kRegularFile);
  if (!text) return tl::unexpected(text.error());
  auto parsed = read(*text);
  if (!parsed) return fail_at(printable(path), parsed.error());
  return parsed;
}

}  // namespace tfdude::keys
