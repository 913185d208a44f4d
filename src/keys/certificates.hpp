#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"

#include "keys/openssl.hpp"

// Certificates, the list of revoked ones, and signed documents. Keys are on the curve P-256.
namespace tfdude::keys {

struct Validity {
  Time from;
  Time until;
};

/// A key and its certificate.
struct Pair {
  Key key;
  Certificate certificate;
};

/// An authority, which signs itself. Its name contains a random number, so others have other names.
[[nodiscard]] Result<Pair> make_authority(const Validity& validity);

/// A new key, and a certificate for it. @param name  ASCII that needs no escapes, at most 64 bytes
[[nodiscard]] Result<Pair> issue(const Pair& authority, const std::string& name,
                                 const Validity& validity);

/// The list of these serial numbers, signed. It is valid as long as the authority, because peers
/// reject all certificates once a list has expired.
[[nodiscard]] Result<RevokedList> make_revoked(const Pair& authority,
                                               const std::vector<std::string>& serials, Time now);

/// The subject of a certificate as permissions name it: "CN=NAME".
[[nodiscard]] std::string subject_of(const std::string& name);
/// The name in the certificate's subject.
[[nodiscard]] std::string name_of(const Certificate& certificate);
/// Two digits a byte.
[[nodiscard]] Result<std::string> random_digits(std::size_t bytes);
/// In hexadecimal digits.
[[nodiscard]] std::string serial_of(const Certificate& certificate);
[[nodiscard]] Result<Validity> validity_of(const Certificate& certificate);

/// Checks what a participant checks about its peer: the signature, and that the certificate is
/// valid now and not revoked. The authority must be valid, too.
[[nodiscard]] Result<void> verify(const Certificate& authority, const RevokedList& revoked,
                                  const Certificate& certificate, Time now);

/// Signs a text as S/MIME, which shows the text.
[[nodiscard]] Result<std::string> sign_document(const Pair& authority, std::string_view text);

/// @return the text, if this authority itself signed it
[[nodiscard]] Result<std::string> verify_document(const Certificate& authority,
                                                  std::string_view document);

}  // namespace tfdude::keys
