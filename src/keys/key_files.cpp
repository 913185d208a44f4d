#include "tfdude/keys/key_files.hpp"

#include <unistd.h>

#include <openssl/x509.h>

#include "tfdude/keys/key_store.hpp"

#include "keys/identity_files.hpp"
#include "keys/permissions.hpp"
#include "keys/secret_files.hpp"

namespace tfdude {

namespace keys {

KeyFiles files_in(const std::string& directory) {
  KeyFiles files;
  files.key = directory + "/key.pem";
  files.certificate = directory + "/certificate.pem";
  files.authority = directory + "/authority.pem";
  files.revoked = directory + "/revoked.pem";
  files.governance = directory + "/governance.p7s";
  files.permissions = directory + "/permissions.p7s";
  return files;
}

std::string identity_of(const Certificate& certificate) {
  const std::string name = name_of(certificate);
  return name.substr(0, name.rfind(' '));
}

}  // namespace keys

namespace {

using keys::Certificate;
using keys::parse_file;

struct Certificates {
  Certificate authority;
  Certificate own;
};

tl::unexpected<Error> wrong(const std::string& path, const std::string& what) {
  return fail(Errc::kConfig, printable(path) + ": " + what);
}

// Says more than OpenSSL does about a certificate that is not valid at this time.
Result<Time> check_validity(const std::string& path, const Certificate& certificate, Time now) {
  const auto validity = keys::validity_of(certificate);
  if (!validity) return fail_at(printable(path), validity.error());
  if (now >= validity->until) {
    return wrong(path,
                 "expired at " + to_string(validity->until) + "; renew it: tfdude keys renew");
  }
  if (now < validity->from) {
    return wrong(path, "is valid from " + to_string(validity->from) + " on, but the clock says " +
                           to_string(now));
  }
  return validity->until;
}

Result<Certificates> read_certificates(KeyFiles& files, Time now) {
  auto authority = parse_file(files.authority, keys::read_certificate);
  if (!authority) return tl::unexpected(authority.error());
  auto own = parse_file(files.certificate, keys::read_certificate);
  if (!own) return tl::unexpected(own.error());
  const auto revoked = parse_file(files.revoked, keys::read_revoked);
  if (!revoked) return tl::unexpected(revoked.error());
  if (auto valid = check_validity(files.authority, *authority, now); !valid) {
    return tl::unexpected(valid.error());
  }
  const auto until = check_validity(files.certificate, *own, now);
  if (!until) return tl::unexpected(until.error());
  files.until = *until;
  files.identity = keys::identity_of(*own);
  files.authority_name = keys::name_of(*authority);
  if (auto ok = keys::verify(*authority, *revoked, *own, now); !ok) {
    return fail_at(printable(files.certificate), ok.error());
  }
  return Certificates{*std::move(authority), *std::move(own)};
}

Result<void> check_key(const KeyFiles& files, const Certificate& certificate) {
  const auto key = parse_file(files.key, keys::read_key);
  if (!key) return tl::unexpected(key.error());
  if (auto ok = keys::check_secret(files.key); !ok) return ok;
  if (X509_check_private_key(certificate.get(), key->get()) == 1) return {};
  return wrong(files.key, "is not the key of " + printable(files.certificate) +
                              " (OpenSSL: " + keys::openssl_reason() + ")");
}

Result<void> read_documents(KeyFiles& files, const Certificates& certificates) {
  const auto verified = [&](const std::string& text) {
    return keys::verify_document(certificates.authority, text);
  };
  const auto governance = parse_file(files.governance, verified);
  if (!governance) return tl::unexpected(governance.error());
  const auto settings = keys::read_governance(*governance);
  if (!settings) return fail_at(printable(files.governance), settings.error());
  const auto permissions = parse_file(files.permissions, verified);
  if (!permissions) return tl::unexpected(permissions.error());
  const auto grant = keys::read_permissions(*permissions);
  if (!grant) return fail_at(printable(files.permissions), grant.error());
  if (grant->subject != keys::subject_of(keys::name_of(certificates.own))) {
    return wrong(files.permissions, "is for the certificate " + quote(grant->subject) +
                                        ", not for " + printable(files.certificate));
  }
  const std::string other = "is not what this version writes; renew it: tfdude keys renew";
  if (keys::governance_of(*settings) != *governance) return wrong(files.governance, other);
  if (keys::permissions_of(*grant) != *permissions) return wrong(files.permissions, other);
  files.settings = *settings;
  files.roles = grant->roles;
  return {};
}

// A user who can replace one of the files can make this program trust another authority. A file
// that is missing is named when it is read, and the key has a check of its own.
Result<void> check_all_unchangeable(const std::string& directory, const KeyFiles& files) {
  for (const std::string& path : {directory, files.certificate, files.authority, files.revoked,
                                  files.governance, files.permissions}) {
    if (access(path.c_str(), F_OK) != 0) continue;
    if (auto ok = keys::check_unchangeable(path); !ok) return ok;
  }
  return {};
}

}  // namespace

Result<KeyFiles> find_keys(const std::string& directory, Time now) {
  if (is_key_store(directory)) {
    return wrong(directory, "is a key store; give the directory of one identity in it");
  }
  KeyFiles files = keys::files_in(directory);
  if (auto ok = check_all_unchangeable(directory, files); !ok) return tl::unexpected(ok.error());
  const auto certificates = read_certificates(files, now);
  if (!certificates) return tl::unexpected(certificates.error());
  if (auto ok = check_key(files, certificates->own); !ok) return tl::unexpected(ok.error());
  if (auto ok = read_documents(files, *certificates); !ok) return tl::unexpected(ok.error());
  return files;
}

}  // namespace tfdude
