#pragma once

#include <string>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/keys/roles.hpp"
#include "tfdude/keys/settings.hpp"

namespace tfdude {

/// The directory of one identity: all that a participant needs, so it can be copied to its host.
struct KeyFiles {
  std::string identity;  ///< its name
  Roles roles;
  KeySettings settings;
  Time until;                  ///< its certificate expires then
  std::string authority_name;  ///< with a random number, so others have other names

  // Paths.
  std::string key;
  std::string certificate;
  std::string authority;    ///< the certificate of the authority, for identities and permissions
  std::string revoked;      ///< the list of revoked certificates
  std::string governance;   ///< signed by the authority
  std::string permissions;  ///< signed by the authority
};

/// Finds the files of an identity, and checks what a peer will check.
/// @return kConfig naming the file: one is missing or cannot be read; others than its owner can
///   read the key; the certificate is expired, not yet valid, revoked or not of this key; the
///   authority did not sign it or a document; the permissions are not those of these roles
[[nodiscard]] TFDUDE_EXPORT Result<KeyFiles> find_keys(const std::string& directory, Time now);

}  // namespace tfdude
