#include "tfdude/keys/key_files.hpp"

#include <filesystem>
#include <string>
#include <unistd.h>

#include <openssl/pkcs7.h>

#include "keys/certificates.hpp"
#include "keys/identity_files.hpp"
#include "keys/permissions.hpp"
#include "support/catch.hpp"
#include "support/key_store.hpp"

namespace tfdude {
namespace {

namespace fs = std::filesystem;

using testing::ContainsSubstring;
using testing::content_of;
using testing::daemon_of;
using testing::kKeysTime;
using testing::looking;
using testing::moving;
using testing::observing;
using testing::TestKeys;

const char* const kFiles[] = {"key.pem",     "certificate.pem", "authority.pem",
                              "revoked.pem", "governance.p7s",  "permissions.p7s"};

std::string error_at(const std::string& directory) {
  const auto found = find_keys(directory, kKeysTime);
  REQUIRE_FALSE(found);
  CHECK(found.error().code == Errc::kConfig);
  return found.error().message;
}

void write(const std::string& path, const std::string& text) { std::ofstream(path) << text; }

// As Fast DDS 2.9 verifies a document: the signer's certificate comes with it.
bool accepted_by_fastdds_2(const keys::Certificate& authority, const std::string& document) {
  const keys::Bio in = keys::bio_of(document);
  BIO* content = nullptr;
  const keys::Signed made(SMIME_read_PKCS7(in.get(), &content));
  const keys::Bio owned(content);
  const keys::Owned<X509_STORE, X509_STORE_free> store(X509_STORE_new());
  REQUIRE(X509_STORE_add_cert(store.get(), authority.get()) == 1);
  const keys::Bio out = keys::sink();
  return PKCS7_verify(made.get(), nullptr, store.get(), content, out.get(), PKCS7_TEXT) == 1;
}

}  // namespace

TEST_CASE("keys: each file that is missing is named") {
  const TestKeys store;
  (void)store.add("arm", daemon_of("arm"));
  for (const char* file : kFiles) {
    const std::string path = store.path("arm/") + file;
    const std::string good = content_of(path);
    fs::remove(path);
    CHECK_THAT(error_at(store.path("arm")), ContainsSubstring(path + ": cannot be opened"));
    write(path, "damaged");
    fs::permissions(path, fs::perms(0600));
    CHECK_THAT(error_at(store.path("arm")), ContainsSubstring(path + ": is n"));
    write(path, good);
    CHECK(find_keys(store.path("arm"), kKeysTime));
  }
  CHECK_THAT(error_at(store.path("leg")), ContainsSubstring("/leg/"));
  CHECK_THAT(error_at(store.path()), ContainsSubstring("is a key store"));
}

TEST_CASE("keys: a key that others can read is rejected") {
  const TestKeys store;
  const KeyFiles files = store.add("arm", daemon_of("arm"));
  for (const unsigned mode : {0640U, 0604U, 0620U, 0777U}) {
    fs::permissions(files.key, fs::perms(mode));
    CHECK_THAT(error_at(store.path("arm")),
               ContainsSubstring("key.pem: others than its owner have access (mode 0"));
  }
  fs::permissions(files.key, fs::perms(0400));
  CHECK(find_keys(store.path("arm"), kKeysTime));
}

TEST_CASE("keys: a directory or file that others can change is rejected") {
  const TestKeys store;
  const KeyFiles files = store.add("arm", daemon_of("arm"));
  const std::string directory = store.path("arm");
  for (const std::string& path : {directory, files.certificate, files.authority, files.revoked,
                                  files.governance, files.permissions}) {
    const fs::perms good = fs::status(path).permissions();
    for (const unsigned mode : {0020U, 0002U}) {
      fs::permissions(path, fs::perms(mode), fs::perm_options::add);
      CHECK_THAT(error_at(directory), ContainsSubstring(path + ": others than its owner can"));
      fs::permissions(path, good);
    }
    fs::permissions(path, fs::perms(0044), fs::perm_options::add);
    CHECK(find_keys(directory, kKeysTime));
    fs::permissions(path, good);
  }
}

TEST_CASE("keys: a directory or file of another user is rejected") {
  if (geteuid() != 0) {
    WARN("SKIPPED: only root can give files away");
    return;
  }
  const TestKeys store;
  const KeyFiles files = store.add("arm", daemon_of("arm"));
  const std::string directory = store.path("arm");
  constexpr uid_t kNobody = 65534;
  for (const std::string& path : {directory, files.key, files.certificate, files.authority,
                                  files.revoked, files.governance, files.permissions}) {
    REQUIRE(chown(path.c_str(), kNobody, kNobody) == 0);
    CHECK_THAT(error_at(directory), ContainsSubstring(path + ": belongs to user 65534"));
    REQUIRE(chown(path.c_str(), 0, 0) == 0);
  }
  CHECK(find_keys(directory, kKeysTime));
}

TEST_CASE("keys: changed permissions are found") {
  const TestKeys store;
  const KeyFiles files = store.add("eye", moving("arm"));
  for (const std::string& path : {files.permissions, files.governance}) {
    const std::string good = content_of(path);
    const bool permissions = path == files.permissions;
    const std::string part = permissions ? "<partition>arm<" : ">ENCRYPT<";
    std::string changed = good;
    changed.replace(changed.find(part), part.size(), permissions ? "<partition>leg<" : ">NONE<");
    write(path, changed);
    CHECK_THAT(error_at(store.path("eye")),
               ContainsSubstring(path + ": is not what the authority signed"));
    write(path, good);
  }
  CHECK(find_keys(store.path("eye"), kKeysTime));
}

TEST_CASE("keys: files of another identity or authority are rejected") {
  const TestKeys store;
  (void)store.add("arm", daemon_of("arm"));
  (void)store.add("eye", looking());
  const TestKeys elsewhere;
  (void)elsewhere.add("arm", daemon_of("arm"));
  for (const char* file : kFiles) {
    INFO(file);
    const std::string path = store.path("eye/") + file;
    const std::string good = content_of(path);
    const std::string name = file;
    const bool own = name == "key.pem" || name == "certificate.pem" || name == "permissions.p7s";
    write(path, content_of(store.path("arm/") + file));
    CHECK(find_keys(store.path("eye"), kKeysTime).has_value() == !own);
    write(path, content_of(elsewhere.path("arm/") + file));
    CHECK_FALSE(find_keys(store.path("eye"), kKeysTime));
    write(path, good);
  }
}

// Documents with the authority's signature that this version would not write.
TEST_CASE("keys: documents of another version are reported and can be renewed") {
  const TestKeys store;
  const KeyFiles files = store.add("eye", looking());
  const keys::Pair authority{
      *keys::read_key(content_of(store.path("authority/key.pem"))),
      *keys::read_certificate(content_of(store.path("authority/certificate.pem")))};
  for (const std::string& path : {files.permissions, files.governance}) {
    auto text = keys::verify_document(authority.certificate, content_of(path));
    REQUIRE(text);
    const bool permissions = path == files.permissions;
    const std::string part = permissions ? ">DENY<" : ">true<";
    text->replace(text->find(part), part.size(), permissions ? ">ALLOW<" : ">false<");
    write(path, *keys::sign_document(authority, *text));
    CHECK_THAT(error_at(store.path("eye")),
               ContainsSubstring(path + ": is not what this version writes"));
    const auto renewed = renew_identity(store.path(), "eye", Days(1), kKeysTime);
    REQUIRE(renewed);
    CHECK(renewed->roles == looking());
  }
}

TEST_CASE("keys: an identity cannot sign permissions for itself") {
  const Time now = std::chrono::system_clock::now();  // Fast DDS takes no other
  const keys::Validity validity{now - Days(1), now + Days(1)};
  const auto authority = keys::make_authority(validity);
  const auto thief = keys::issue(*authority, "thief 1", validity);
  REQUIRE(thief);
  const keys::Grant grant{"CN=thief 1", *complete(observing()), {}, now, now};
  const std::string text = keys::permissions_of(grant);
  const auto good = keys::sign_document(*authority, text);
  const auto forged = keys::sign_document(*thief, text);
  REQUIRE(forged);
  CHECK(keys::verify_document(authority->certificate, *good));
  CHECK_FALSE(keys::verify_document(authority->certificate, *forged));
  CHECK(accepted_by_fastdds_2(authority->certificate, *good));
  CHECK_FALSE(accepted_by_fastdds_2(authority->certificate, *forged));
}

}  // namespace tfdude
