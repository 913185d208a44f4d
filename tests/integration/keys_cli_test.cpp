// The commands of `tfdude keys`. They need no participant.

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/catch.hpp"
#include "support/key_store.hpp"
#include "support/process.hpp"
#include "support/test_domain.hpp"

namespace tfdude {
namespace {

namespace fs = std::filesystem;

using nlohmann::json;
using testing::CliResult;
using testing::ContainsSubstring;
using testing::content_of;
using testing::Process;
using testing::TemporaryDirectory;
using Arguments = std::vector<std::string>;

CliResult run(Arguments arguments) {
  arguments.insert(arguments.begin(), TFDUDE_CLI);
  Process process(arguments);
  return testing::finish(process);
}

CliResult keys(Arguments arguments) {
  arguments.insert(arguments.begin(), "keys");
  return run(std::move(arguments));
}

json answered(const Arguments& arguments, int status = 0) {
  Arguments all{"--json", "keys"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  const CliResult result = run(all);
  INFO(result.out << result.err);
  CHECK(result.status == status);
  return json::parse(result.out);
}

struct Store {
  Store() {
    REQUIRE(keys({"init", path}).status == 0);
    REQUIRE(keys({"daemon", path, "arm"}).status == 0);
    REQUIRE(keys({"client", path, "planner", "--look", "--move", "arm", "--move", "base",
                  "--stream", "legs", "--observe"})
                .status == 0);
  }

  TemporaryDirectory directory;
  std::string path = directory.path() + "/keys";
};

}  // namespace

TEST_CASE("keys command: creates keys and prints what they allow") {
  const Store store;
  const CliResult said = keys({"check", store.path});
  CHECK(said.status == 0);
  CHECK_THAT(said.out, ContainsSubstring("tf-dude authority ") &&
                           ContainsSubstring("messages are encrypted; domains 0 to 232") &&
                           ContainsSubstring("arm, valid until ") &&
                           ContainsSubstring("serves partition 'arm'") &&
                           ContainsSubstring("changes partitions 'arm', 'base'"));
  const json checked = answered({"check", store.path});
  REQUIRE(checked.at("identities").size() == 2);
  json planner = checked.at("identities").at(1);
  CHECK_THAT(planner.at("until").get<std::string>(), ContainsSubstring(" UTC"));
  planner.erase("until");
  CHECK(planner == json({{"identity", "planner"},
                         {"encrypt", true},
                         {"domains", {0, 232}},
                         {"serves", nullptr},
                         {"look", true},
                         {"move", {"arm", "base"}},
                         {"stream", {"legs"}},
                         {"observe", true},
                         {"publish_clock", false},
                         {"error", nullptr}}));
  CHECK(answered({"check", store.path + "/arm"}).at("identities").at(0).at("serves") == "arm");
}

TEST_CASE("keys command: options of a key store and of an identity") {
  const TemporaryDirectory directory;
  const std::string path = directory.path() + "/keys";
  CHECK(answered({"init", path, "--sign", "--domains", "3", "7", "--days", "40"}).at("done") ==
        "created");
  const json made =
      answered({"daemon", path, "left arm", "--name", "left", "--move", "base", "--days", "2"});
  CHECK(made.at("identity") == "left");
  CHECK(made.at("serves") == "left arm");
  CHECK(made.at("move") == json({"base"}));
  CHECK(made.at("encrypt") == false);
  CHECK(made.at("domains") == json({3, 7}));
  CHECK_THAT(keys({"check", path}).out,
             ContainsSubstring("messages are signed, not encrypted; domains 3 to 7"));
}

TEST_CASE("keys command: renews and revokes") {
  const Store store;
  const std::string before = content_of(store.path + "/arm/key.pem");
  CHECK(answered({"renew", store.path, "arm", "--days", "3"}).at("done") == "renewed");
  CHECK(content_of(store.path + "/arm/key.pem") != before);
  const CliResult all = keys({"renew", store.path});
  CHECK_THAT(all.out, ContainsSubstring("renewed arm, ") && ContainsSubstring("renewed planner, "));
  CHECK(answered({"revoke", store.path, "arm"}) ==
        json({{"done", "revoked"}, {"identity", "arm"}}));
  const json checked = answered({"check", store.path});
  CHECK(checked.at("revoked") == json({"arm"}));
  CHECK(checked.at("identities").size() == 1);
  CHECK_THAT(keys({"check", store.path}).out, ContainsSubstring("revoked: arm\n"));
}

TEST_CASE("keys command: names what is wrong with keys") {
  const Store store;
  fs::permissions(store.path + "/arm/key.pem", fs::perms(0644));
  const std::string permissions = store.path + "/planner/permissions.p7s";
  std::string text = content_of(permissions);
  text.replace(text.find(">legs<"), 6, ">arms<");
  std::ofstream(permissions) << text;
  const json checked = answered({"check", store.path}, 1);
  CHECK_THAT(checked.at("identities").at(0).at("error").get<std::string>(),
             ContainsSubstring("arm/key.pem: others than its owner have access (mode 0644)"));
  CHECK_THAT(checked.at("identities").at(1).at("error").get<std::string>(),
             ContainsSubstring("planner/permissions.p7s: is not what the authority signed"));
  const CliResult said = keys({"check", store.path});
  CHECK(said.status == 1);
  CHECK_THAT(said.out, ContainsSubstring("error: "));
}

TEST_CASE("keys command: wrong usage is rejected") {
  const Store store;
  const std::string path = store.path;
  const auto rejected = [](const Arguments& arguments, int status, const char* code,
                           const std::string& part) {
    const json error = answered(arguments, status).at("error");
    CHECK(error.at("code") == code);
    CHECK_THAT(error.at("message").get<std::string>(), ContainsSubstring(part));
  };
  rejected({}, 2, "usage", "one of init, daemon");
  rejected({"check"}, 2, "usage", "DIR");
  rejected({"check", path, "--domain", "3"}, 2, "usage", "--domain");
  rejected({"init", path, "--days", "0"}, 2, "usage", "--days");
  rejected({"init", path, "--domains", "0", "233"}, 2, "usage", "233");
  rejected({"init", path, "--domains", "7", "3"}, 1, "invalid_input", "7 to 3");
  rejected({"init", path}, 1, "already_exists", path);
  rejected({"client", path, "x"}, 1, "invalid_input", "'x'");
  rejected({"client", path, "x", "--move", "--look"}, 2, "usage", "'--look'");
  rejected({"client", path, "x", "--move", "a*"}, 1, "invalid_input", "'a*'");
  rejected({"client", path, "a b", "--look"}, 1, "invalid_input", "'a b'");
  rejected({"client", path, "planner", "--look"}, 1, "already_exists", "'planner'");
  rejected({"daemon", path, "a/b"}, 1, "invalid_input", "'a/b'");
  rejected({"renew", path, "nobody"}, 1, "invalid_input", "'nobody'");
  rejected({"revoke", path, "nobody"}, 1, "invalid_input", "'nobody'");
  rejected({"daemon", path + "/none", "x"}, 2, "config", "/none");
  CHECK_THAT(answered({"check", path + "/none"}, 1).at("identities").at(0).at("error"),
             ContainsSubstring("/none/authority.pem: cannot be opened"));
}

}  // namespace tfdude
