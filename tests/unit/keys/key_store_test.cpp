#include "tfdude/keys/key_store.hpp"

#include <filesystem>
#include <map>
#include <string>
#include <sys/stat.h>

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
using testing::TestKeys;

constexpr Days kDay{1};

// All files below a directory, with their contents.
std::map<std::string, std::string> files_below(const std::string& directory) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(directory)) {
    if (entry.is_regular_file()) files[entry.path()] = content_of(entry.path());
  }
  return files;
}

unsigned mode_of(const std::string& path) {
  struct stat found {};
  REQUIRE(stat(path.c_str(), &found) == 0);
  return found.st_mode & 07777U;
}

std::string error_of(const Result<KeyFiles>& result) {
  REQUIRE_FALSE(result);
  return result.error().message;
}

}  // namespace

TEST_CASE("key store: only the owner can read its files") {
  const mode_t before = umask(0);
  const TestKeys store;
  (void)store.add("arm", daemon_of("arm"));
  umask(before);
  std::size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(store.path())) {
    INFO(entry.path());
    CHECK(mode_of(entry.path()) == (entry.is_directory() ? 0700 : 0600));
    if (entry.is_regular_file()) ++files;
  }
  CHECK(files ==
        10);  // six of the identity, and key, certificate, governance, list of the authority
  CHECK(mode_of(store.path()) == 0700);
  const std::string secret = content_of(store.path("authority/key.pem"));
  CHECK_THAT(secret, ContainsSubstring("PRIVATE KEY"));
  for (const auto& [path, text] : files_below(store.path("arm"))) CHECK(text != secret);
}

TEST_CASE("key store: a copied directory is complete") {
  const TestKeys store(kKeysTime, {false, {4, 6}});
  Roles roles = daemon_of("upper arm");
  roles.move = {"base"};
  const KeyFiles added = store.add("arm", roles, 2 * kDay);
  const testing::TemporaryDirectory host;
  fs::copy(store.path("arm"), host.path() + "/arm");
  const auto found = find_keys(host.path() + "/arm", kKeysTime);
  REQUIRE(found);
  CHECK(found->identity == "arm");
  CHECK(found->roles == *complete(roles));
  CHECK(found->settings == KeySettings{false, {4, 6}});
  CHECK(found->until == kKeysTime + 2 * kDay);
  CHECK(found->key == host.path() + "/arm/key.pem");
  CHECK(content_of(found->permissions) == content_of(added.permissions));
}

TEST_CASE("key store: certificates expire") {
  const TestKeys store;
  (void)store.add("arm", daemon_of("arm"), 2 * kDay);
  CHECK(find_keys(store.path("arm"), kKeysTime + 2 * kDay - std::chrono::seconds(1)));
  CHECK_THAT(error_of(find_keys(store.path("arm"), kKeysTime + 2 * kDay)),
             ContainsSubstring("arm/certificate.pem: expired at 2030-03-19 17:46:40.000 UTC"));
  CHECK(find_keys(store.path("arm"), kKeysTime - kDay));
  CHECK_THAT(error_of(find_keys(store.path("arm"), kKeysTime - 2 * kDay)),
             ContainsSubstring("is valid from 2030-03-16"));
}

TEST_CASE("key store: no identity outlives the authority") {
  const TestKeys store(kKeysTime, {}, 10 * kDay);
  CHECK(store.add("arm", daemon_of("arm"), 20 * kDay).until == kKeysTime + 10 * kDay);
  const Time later = kKeysTime + 11 * kDay;
  CHECK_THAT(error_of(find_keys(store.path("arm"), later)), ContainsSubstring("expired"));
  const auto added = add_identity(store.path(), "base", daemon_of("base"), kDay, later);
  CHECK_THAT(error_of(added), ContainsSubstring("authority/certificate.pem: expired at"));
}

TEST_CASE("key store: renewal keeps the roles, also after expiry") {
  const TestKeys store;
  Roles roles = moving("arm");
  roles.observe = true;
  const KeyFiles before = store.add("planner", roles, kDay);
  const std::string key = content_of(before.key);
  const std::string permissions = content_of(before.permissions);
  const Time later = kKeysTime + 30 * kDay;
  const auto renewed = renew_identity(store.path(), "planner", 5 * kDay, later);
  REQUIRE(renewed);
  CHECK(renewed->roles == before.roles);
  CHECK(renewed->until == later + 5 * kDay);
  CHECK(content_of(renewed->key) != key);
  CHECK(content_of(renewed->permissions) != permissions);
  CHECK(fs::exists(store.path("authority")));
  CHECK(read_key_store(store.path(), later)->identities == std::vector<std::string>{"planner"});
  CHECK_FALSE(fs::exists(store.path(".planner.new")));
}

TEST_CASE("key store: permissions fit one certificate only") {
  const TestKeys store;
  (void)store.add("arm", daemon_of("arm"));
  const std::string earlier = content_of(store.path("arm/permissions.p7s"));
  REQUIRE(renew_identity(store.path(), "arm", kDay, kKeysTime));
  std::ofstream(store.path("arm/permissions.p7s")) << earlier;
  CHECK_THAT(error_of(find_keys(store.path("arm"), kKeysTime)),
             ContainsSubstring("permissions.p7s: is for the certificate 'CN=arm "));
}

TEST_CASE("key store: a revoked identity is rejected by all that have the list") {
  const TestKeys store;
  (void)store.add("arm", daemon_of("arm"));
  const KeyFiles base = store.add("base", daemon_of("base"));
  const testing::TemporaryDirectory thief;
  const fs::path stolen = thief.path();
  fs::copy(store.path("arm"), stolen / "first");
  REQUIRE(renew_identity(store.path(), "arm", kIdentityLifetime, kKeysTime));
  fs::copy(store.path("arm"), stolen / "second");

  REQUIRE(revoke_identity(store.path(), "arm", kKeysTime));
  CHECK_FALSE(fs::exists(store.path("arm")));
  const auto info = read_key_store(store.path(), kKeysTime);
  CHECK(info->identities == std::vector<std::string>{"base"});
  CHECK(info->revoked == std::vector<std::string>{"arm"});
  CHECK(find_keys(store.path("base"), kKeysTime));
  for (const char* copy : {"first", "second"}) {
    CHECK(find_keys(stolen / copy, kKeysTime));
    fs::copy(base.revoked, stolen / copy / "revoked.pem", fs::copy_options::overwrite_existing);
    CHECK_THAT(error_of(find_keys(stolen / copy, kKeysTime)),
               ContainsSubstring("certificate.pem: certificate revoked"));
  }
  // The list is valid as long as the authority is, and comes with each new identity.
  CHECK_THAT(error_of(find_keys(stolen / "first", kKeysTime + 300 * kDay)),
             ContainsSubstring("revoked"));
  CHECK(store.add("arm", looking()).roles == looking());
  fs::copy(store.path("arm/revoked.pem"), stolen / "first/revoked.pem",
           fs::copy_options::overwrite_existing);
  CHECK_THAT(error_of(find_keys(stolen / "first", kKeysTime)), ContainsSubstring("revoked"));
  REQUIRE_FALSE(revoke_identity(store.path(), "leg", kKeysTime));
}

TEST_CASE("key store: wrong input changes nothing") {
  const TestKeys store;
  (void)store.add("arm", daemon_of("arm"));
  const auto before = files_below(store.path());
  const auto rejected = [&](const auto& result, Errc code) {
    REQUIRE_FALSE(result);
    CHECK(result.error().code == code);
    CHECK(files_below(store.path()) == before);
  };
  const std::string path = store.path();
  for (const std::string& name :
       {std::string(), std::string("authority"), std::string("."), std::string(".."),
        std::string("a/b"), std::string("-a"), std::string("a b"), std::string("a,O=b"),
        std::string("a<b"), std::string("\u00e4"), std::string("a\n"), std::string(48, 'a')}) {
    INFO(name);
    rejected(add_identity(path, name, looking(), kDay, kKeysTime), Errc::kInvalidInput);
    rejected(revoke_identity(path, name, kKeysTime), Errc::kInvalidInput);
    rejected(renew_identity(path, name, kDay, kKeysTime), Errc::kInvalidInput);
  }
  rejected(add_identity(path, "arm", looking(), kDay, kKeysTime), Errc::kAlreadyExists);
  rejected(add_identity(path, "base", Roles(), kDay, kKeysTime), Errc::kInvalidInput);
  rejected(add_identity(path, "base", daemon_of("a/b"), kDay, kKeysTime), Errc::kInvalidInput);
  rejected(add_identity(path, "base", daemon_of("b*"), kDay, kKeysTime), Errc::kInvalidInput);
  for (const Days lifetime : {Days(0), Days(-1), Days(36501)}) {
    rejected(add_identity(path, "base", looking(), lifetime, kKeysTime), Errc::kInvalidInput);
    rejected(renew_identity(path, "arm", lifetime, kKeysTime), Errc::kInvalidInput);
  }
  rejected(create_key_store(path, {}, kDay, kKeysTime), Errc::kAlreadyExists);
  rejected(create_key_store(path + "/x", {true, {3, 2}}, kDay, kKeysTime), Errc::kInvalidInput);
  rejected(create_key_store(path + "/x", {true, {0, 233}}, kDay, kKeysTime), Errc::kInvalidInput);
  rejected(create_key_store(path + "/x/y", {}, kDay, kKeysTime), Errc::kConfig);
  rejected(add_identity(path + "/arm", "b", looking(), kDay, kKeysTime), Errc::kConfig);
  CHECK(find_keys(path + "/arm", kKeysTime));
}

TEST_CASE("key store: a damaged authority is named, and nothing changes") {
  const TestKeys store;
  (void)store.add("arm", daemon_of("arm"));
  const TestKeys other;
  for (const char* file : {"key.pem", "certificate.pem", "governance.p7s", "issued"}) {
    INFO(file);
    const std::string path = store.path("authority/") + file;
    const std::string good = content_of(path);
    const std::string strange = content_of(other.path("authority/") + file);
    for (const std::string& bad : {std::string("damaged\n"), strange}) {
      if (bad.empty()) continue;  // no certificates were issued there
      std::ofstream(path) << bad;
      const auto before = files_below(store.path());
      const auto added = add_identity(store.path(), "base", daemon_of("base"), kDay, kKeysTime);
      CHECK_THAT(error_of(added), ContainsSubstring("/authority/"));
      CHECK_FALSE(revoke_identity(store.path(), "arm", kKeysTime));
      CHECK(files_below(store.path()) == before);
    }
    std::ofstream(path) << good;
  }
  fs::permissions(store.path("authority/key.pem"), fs::perms(0640));
  CHECK_THAT(error_of(renew_identity(store.path(), "arm", kDay, kKeysTime)),
             ContainsSubstring("authority/key.pem: others than its owner have access (mode 0640)"));
}

}  // namespace tfdude
