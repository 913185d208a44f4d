#pragma once

#include <chrono>
#include <ratio>
#include <string>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/keys/key_files.hpp"
#include "tfdude/keys/roles.hpp"
#include "tfdude/keys/settings.hpp"

// A key store: a directory with an authority, whose key must not leave it, and one directory for
// each identity. A change happens completely or not at all; two processes take turns. All
// functions fail with kConfig naming the file if one cannot be read or written.
namespace tfdude {

using Days = std::chrono::duration<int, std::ratio<86400>>;

inline constexpr Days kAuthorityLifetime{3650};
inline constexpr Days kIdentityLifetime{365};
inline constexpr Days kMaxLifetime{36500};

/// Checks the name of an identity: 1 to 47 letters, digits, '.', '_' and '-', the first one a
/// letter or digit. 'authority' is taken.
/// @return kInvalidInput naming it
[[nodiscard]] TFDUDE_EXPORT Result<void> check_identity(const std::string& name);

/// Creates a key store. @return kAlreadyExists if the directory is one
[[nodiscard]] TFDUDE_EXPORT Result<void> create_key_store(const std::string& store,
                                                          const KeySettings& settings,
                                                          Days lifetime, Time now);

/// Creates an identity. It expires no later than the authority.
/// @return kAlreadyExists, or kInvalidInput naming what is wrong
[[nodiscard]] TFDUDE_EXPORT Result<KeyFiles> add_identity(const std::string& store,
                                                          const std::string& name,
                                                          const Roles& roles, Days lifetime,
                                                          Time now);

/// Replaces an identity's key, certificate and permissions. Its roles stay, and the previous files
/// remain valid until they expire. @return kInvalidInput if there is no such identity
[[nodiscard]] TFDUDE_EXPORT Result<KeyFiles> renew_identity(const std::string& store,
                                                            const std::string& name, Days lifetime,
                                                            Time now);

/// Revokes all certificates that the identity ever had, and deletes its directory. Participants
/// learn of it from the list of revoked certificates, which is in the directories of all others.
/// @return kInvalidInput if there is no such identity
[[nodiscard]] TFDUDE_EXPORT Result<void> revoke_identity(const std::string& store,
                                                         const std::string& name, Time now);

/// What a key store contains.
struct KeyStoreInfo {
  std::string authority;  ///< its name
  KeySettings settings;
  Time until;                           ///< the authority expires then, and with it all identities
  std::vector<std::string> identities;  ///< their names, sorted
  std::vector<std::string> revoked;     ///< the names of revoked ones, sorted
};

/// Whether the directory is a key store, and not the directory of one identity.
[[nodiscard]] TFDUDE_EXPORT bool is_key_store(const std::string& directory);

[[nodiscard]] TFDUDE_EXPORT Result<KeyStoreInfo> read_key_store(const std::string& store, Time now);

}  // namespace tfdude
