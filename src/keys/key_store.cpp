#include "tfdude/keys/key_store.hpp"

#include <algorithm>
#include <filesystem>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include "keys/authority.hpp"
#include "keys/certificates.hpp"
#include "keys/identity_files.hpp"
#include "keys/permissions.hpp"
#include "keys/secret_files.hpp"

namespace tfdude {
namespace {

using keys::Authority;
using keys::DirectoryLock;
using keys::write_secret;

constexpr std::size_t kMaxName = 47;  // with a number behind it, it fits a certificate
constexpr std::size_t kNumberBytes = 8;
// Fast DDS reads the dates of permissions in the local time of its host, so they leave room for any
// time zone. The certificate is what expires.
constexpr std::chrono::hours kTimeZones{24};

bool exists(const std::string& path) {
  std::error_code ignored;
  return std::filesystem::exists(path, ignored);
}

std::string directory_of(const std::string& store, const std::string& identity) {
  return store + "/" + identity;
}

Result<void> check_lifetime(Days lifetime) {
  if (lifetime >= Days(1) && lifetime <= kMaxLifetime) return {};
  return fail(Errc::kInvalidInput, std::to_string(lifetime.count()) + " days are not within 1 to " +
                                       std::to_string(kMaxLifetime.count()));
}

// Certificates know seconds.
keys::Validity validity_of(Time now, Days lifetime) {
  const Time second = std::chrono::floor<std::chrono::seconds>(now);
  return {second - keys::kClockTolerance, second + lifetime};
}

struct Named {
  std::string file;
  std::string_view content;
};

// Writes the directory of an identity beside its place.
Result<std::string> write_identity(const Authority& authority, const std::string& name,
                                   const keys::Pair& pair, const std::string& permissions,
                                   Time now) {
  const std::string beside = authority.store + "/." + name + ".new";
  if (auto ok = keys::remove_directory(beside); !ok) return tl::unexpected(ok.error());
  if (auto ok = keys::make_directory(beside); !ok) return tl::unexpected(ok.error());
  const auto key = keys::pem_of(pair.key);
  if (!key) return tl::unexpected(key.error());
  const auto certificate = keys::pem_of(pair.certificate);
  if (!certificate) return tl::unexpected(certificate.error());
  const auto issuer = keys::pem_of(authority.pair.certificate);
  if (!issuer) return tl::unexpected(issuer.error());
  const auto revoked = keys::revoked_list(authority, now);
  if (!revoked) return tl::unexpected(revoked.error());
  const auto governance =
      keys::sign_document(authority.pair, keys::governance_of(authority.settings));
  if (!governance) return tl::unexpected(governance.error());
  const KeyFiles files = keys::files_in(beside);
  for (const Named& one : {Named{files.key, keys::text_of(*key)},
                           {files.certificate, *certificate},
                           {files.authority, *issuer},
                           {files.revoked, *revoked},
                           {files.governance, *governance},
                           {files.permissions, permissions}}) {
    if (auto ok = write_secret(one.file, one.content); !ok) return tl::unexpected(ok.error());
  }
  return beside;
}

// Issues a certificate with permissions, and puts them in the place of those that are there.
Result<KeyFiles> issue(Authority& authority, const std::string& name, const Roles& roles,
                       Days lifetime, Time now) {
  keys::Validity validity = validity_of(now, lifetime);
  validity.until = std::min(validity.until, authority.validity.until);
  const auto number = keys::random_digits(kNumberBytes);
  if (!number) return tl::unexpected(number.error());
  const std::string subject = name + " " + *number;
  const auto pair = keys::issue(authority.pair, subject, validity);
  if (!pair) return tl::unexpected(pair.error());
  const keys::Grant grant{keys::subject_of(subject), roles, authority.settings.domains,
                          validity.from - kTimeZones, validity.until + kTimeZones};
  const auto permissions = keys::sign_document(authority.pair, keys::permissions_of(grant));
  if (!permissions) return tl::unexpected(permissions.error());
  // First, so that whatever exists can be revoked.
  authority.issued.push_back({keys::serial_of(pair->certificate), name, false});
  if (auto ok = keys::store_issued(authority); !ok) return tl::unexpected(ok.error());
  const auto beside = write_identity(authority, name, *pair, *permissions, now);
  if (!beside) return tl::unexpected(beside.error());
  const std::string directory = directory_of(authority.store, name);
  if (auto ok = keys::move_directory(*beside, directory); !ok) return tl::unexpected(ok.error());
  if (auto ok = keys::remove_directory(*beside); !ok) return tl::unexpected(ok.error());
  return find_keys(directory, now);
}

std::vector<std::string> identities_in(const std::string& store) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(store, ignored)) {
    const std::string name = entry.path().filename();
    if (entry.is_directory(ignored) && check_identity(name)) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

Result<void> check_known(const std::string& store, const std::string& name) {
  if (auto ok = check_identity(name); !ok) return ok;
  if (exists(directory_of(store, name))) return {};
  return fail(Errc::kInvalidInput,
              "there is no identity " + quote(name) + " in " + printable(store));
}

}  // namespace

Result<void> check_identity(const std::string& name) {
  const auto alphanumeric = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
  };
  const auto allowed = [&](char c) { return alphanumeric(c) || c == '.' || c == '_' || c == '-'; };
  if (!name.empty() && name.size() <= kMaxName && alphanumeric(name[0]) &&
      std::all_of(name.begin(), name.end(), allowed) && name != "authority") {
    return {};
  }
  return fail(Errc::kInvalidInput,
              "identity " + quote(name) +
                  " needs another name: 1 to 47 letters, digits, '.', '_' and '-', the first one a "
                  "letter or digit, and not 'authority'");
}

bool is_key_store(const std::string& directory) { return keys::has_authority(directory); }

Result<void> create_key_store(const std::string& store, const KeySettings& settings, Days lifetime,
                              Time now) {
  constexpr std::uint32_t kLastDomain = 232;
  if (settings.domains.first > settings.domains.last || settings.domains.last > kLastDomain) {
    return fail(Errc::kInvalidInput, "domains " + std::to_string(settings.domains.first) + " to " +
                                         std::to_string(settings.domains.last) +
                                         " are no range within 0 to 232");
  }
  if (auto ok = check_lifetime(lifetime); !ok) return ok;
  if (auto ok = keys::make_directory(store); !ok) return tl::unexpected(ok.error());
  const auto lock = DirectoryLock::take(store);
  if (!lock) return tl::unexpected(lock.error());
  if (is_key_store(store)) {
    return fail(Errc::kAlreadyExists, printable(store) + ": is a key store already");
  }
  return keys::create_authority(store, settings, validity_of(now, lifetime));
}

Result<KeyFiles> add_identity(const std::string& store, const std::string& name, const Roles& roles,
                              Days lifetime, Time now) {
  if (auto ok = check_identity(name); !ok) return tl::unexpected(ok.error());
  if (auto ok = check_lifetime(lifetime); !ok) return tl::unexpected(ok.error());
  const auto completed = complete(roles);
  if (!completed) return fail_at("identity " + quote(name), completed.error());
  const auto lock = DirectoryLock::take(store);
  if (!lock) return tl::unexpected(lock.error());
  auto authority = keys::open_authority(store, now);
  if (!authority) return tl::unexpected(authority.error());
  if (exists(directory_of(store, name))) {
    return fail(Errc::kAlreadyExists,
                "identity " + quote(name) + " exists already in " + printable(store));
  }
  return issue(*authority, name, *completed, lifetime, now);
}

Result<KeyFiles> renew_identity(const std::string& store, const std::string& name, Days lifetime,
                                Time now) {
  if (auto ok = check_lifetime(lifetime); !ok) return tl::unexpected(ok.error());
  const auto lock = DirectoryLock::take(store);
  if (!lock) return tl::unexpected(lock.error());
  auto authority = keys::open_authority(store, now);
  if (!authority) return tl::unexpected(authority.error());
  if (auto ok = check_known(store, name); !ok) return tl::unexpected(ok.error());
  // Only the permissions are read, because the certificate may have expired.
  const std::string permissions = keys::files_in(directory_of(store, name)).permissions;
  const auto grant = keys::parse_file(permissions, [&](const std::string& text) {
    return keys::verify_document(authority->pair.certificate, text)
        .and_then(keys::read_permissions);
  });
  if (!grant) return tl::unexpected(grant.error());
  return issue(*authority, name, grant->roles, lifetime, now);
}

Result<void> revoke_identity(const std::string& store, const std::string& name, Time now) {
  const auto lock = DirectoryLock::take(store);
  if (!lock) return tl::unexpected(lock.error());
  auto authority = keys::open_authority(store, now);
  if (!authority) return tl::unexpected(authority.error());
  if (auto ok = check_known(store, name); !ok) return ok;
  for (keys::Issued& one : authority->issued) one.revoked = one.revoked || one.identity == name;
  const auto list = keys::revoked_list(*authority, now);
  if (!list) return tl::unexpected(list.error());
  if (auto ok = keys::store_issued(*authority); !ok) return ok;
  for (const std::string& other : identities_in(store)) {
    if (other == name) continue;
    const std::string directory = directory_of(store, other);
    if (auto ok = write_secret(keys::files_in(directory).revoked, *list); !ok) return ok;
  }
  // Last, so that the command can be repeated if it fails.
  return keys::remove_directory(directory_of(store, name));
}

Result<KeyStoreInfo> read_key_store(const std::string& store, Time now) {
  const auto authority = keys::open_authority(store, now);
  if (!authority) return tl::unexpected(authority.error());
  KeyStoreInfo info;
  info.authority = keys::name_of(authority->pair.certificate);
  info.settings = authority->settings;
  info.until = authority->validity.until;
  info.identities = identities_in(store);
  std::set<std::string> revoked;
  for (const keys::Issued& one : authority->issued) {
    if (one.revoked) revoked.insert(one.identity);
  }
  info.revoked.assign(revoked.begin(), revoked.end());
  return info;
}

}  // namespace tfdude
