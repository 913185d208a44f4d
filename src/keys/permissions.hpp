#pragma once

#include <string>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/keys/roles.hpp"
#include "tfdude/keys/settings.hpp"

// The two documents of DDS Security that say who may do what, as text before it is signed.
namespace tfdude::keys {

/// What one identity may do, and when.
struct Grant {
  std::string subject;  ///< of its certificate, as subject_of() writes it
  Roles roles;
  DomainRange domains;
  Time not_before;  ///< to the second
  Time not_after;
};

/// The document of permissions for one identity.
[[nodiscard]] std::string permissions_of(const Grant& grant);

/// Reads a document that permissions_of() wrote, of this or another version. It allows what this
/// version gives to these roles only if permissions_of() returns the same text for them.
/// @return kConfig for any other document
[[nodiscard]] Result<Grant> read_permissions(const std::string& text);

/// The document of governance: what all identities of an authority have in common.
[[nodiscard]] std::string governance_of(const KeySettings& settings);

/// Reads a document that governance_of() wrote, as read_permissions() does.
[[nodiscard]] Result<KeySettings> read_governance(const std::string& text);

}  // namespace tfdude::keys
