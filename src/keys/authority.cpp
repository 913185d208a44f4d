#include "keys/authority.hpp"

#include <filesystem>
#include <sstream>
#include <utility>

#include <openssl/x509.h>

#include "tfdude/base/id.hpp"

#include "keys/identity_files.hpp"
#include "keys/permissions.hpp"
#include "keys/secret_files.hpp"

namespace tfdude::keys {
namespace {

constexpr const char* kKeyFile = "/key.pem";
constexpr const char* kCertificateFile = "/certificate.pem";
constexpr const char* kGovernanceFile = "/governance.p7s";
constexpr const char* kIssuedFile = "/issued";

std::string directory_of(const std::string& store) { return store + "/authority"; }

Result<std::vector<Issued>> read_issued(const std::string& text) {
  std::vector<Issued> all;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    Issued one;
    std::string state;
    words >> state >> one.serial >> one.identity;
    one.revoked = state == "revoked";
    if (one.identity.empty() || (state != "valid" && !one.revoked)) {
      return fail(Errc::kConfig, "line " + std::to_string(all.size() + 1) + " is damaged");
    }
    all.push_back(std::move(one));
  }
  return all;
}

Result<void> write_authority(const std::string& directory, const Pair& pair,
                             const std::string& governance) {
  const auto key = pem_of(pair.key);
  if (!key) return tl::unexpected(key.error());
  const auto certificate = pem_of(pair.certificate);
  if (!certificate) return tl::unexpected(certificate.error());
  if (auto ok = write_secret(directory + kKeyFile, text_of(*key)); !ok) return ok;
  if (auto ok = write_secret(directory + kCertificateFile, *certificate); !ok) return ok;
  if (auto ok = write_secret(directory + kGovernanceFile, governance); !ok) return ok;
  return write_secret(directory + kIssuedFile, "");
}

}  // namespace

bool has_authority(const std::string& store) {
  std::error_code ignored;
  return std::filesystem::is_directory(directory_of(store), ignored);
}

Result<void> create_authority(const std::string& store, const KeySettings& settings,
                              const Validity& validity) {
  const auto pair = make_authority(validity);
  if (!pair) return tl::unexpected(pair.error());
  const auto governance = sign_document(*pair, governance_of(settings));
  if (!governance) return tl::unexpected(governance.error());
  const std::string beside = store + "/.authority.new";
  if (auto ok = remove_directory(beside); !ok) return ok;
  if (auto ok = make_directory(beside); !ok) return tl::unexpected(ok.error());
  if (auto ok = write_authority(beside, *pair, *governance); !ok) return ok;
  return move_directory(beside, directory_of(store));
}

Result<Authority> open_authority(const std::string& store, Time now) {
  if (!has_authority(store)) {
    return fail(Errc::kConfig, printable(store) + ": is no key store; create it: tfdude keys init");
  }
  const std::string directory = directory_of(store);
  if (auto ok = check_secret(directory + kKeyFile); !ok) return tl::unexpected(ok.error());
  auto key = parse_file(directory + kKeyFile, read_key);
  if (!key) return tl::unexpected(key.error());
  auto certificate = parse_file(directory + kCertificateFile, read_certificate);
  if (!certificate) return tl::unexpected(certificate.error());
  const auto validity = validity_of(*certificate);
  if (!validity) return tl::unexpected(validity.error());
  const auto wrong = [&](const std::string& what) {
    return fail(Errc::kConfig, printable(directory + kCertificateFile) + ": " + what);
  };
  if (now >= validity->until) return wrong("expired at " + to_string(validity->until));
  if (now < validity->from) return wrong("is valid from " + to_string(validity->from) + " on");
  if (X509_check_private_key(certificate->get(), key->get()) != 1) {
    return wrong("is not that of key.pem");
  }
  const auto settings = parse_file(directory + kGovernanceFile, [&](const std::string& text) {
    return verify_document(*certificate, text).and_then(read_governance);
  });
  if (!settings) return tl::unexpected(settings.error());
  auto issued = parse_file(directory + kIssuedFile, read_issued);
  if (!issued) return tl::unexpected(issued.error());
  return Authority{store, Pair{*std::move(key), *std::move(certificate)}, *validity, *settings,
                   *std::move(issued)};
}

Result<void> store_issued(const Authority& authority) {
  std::string text;
  for (const Issued& one : authority.issued) {
    text +=
        std::string(one.revoked ? "revoked " : "valid ") + one.serial + " " + one.identity + "\n";
  }
  return write_secret(directory_of(authority.store) + kIssuedFile, text);
}

Result<std::string> revoked_list(const Authority& authority, Time now) {
  std::vector<std::string> serials;
  for (const Issued& one : authority.issued) {
    if (one.revoked) serials.push_back(one.serial);
  }
  const auto list = make_revoked(authority.pair, serials, now - kClockTolerance);
  if (!list) return tl::unexpected(list.error());
  return pem_of(*list);
}

}  // namespace tfdude::keys
