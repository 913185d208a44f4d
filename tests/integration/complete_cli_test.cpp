// Completion: what may stand at a place of the command line, with the names of the living system.

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/thesis.hpp"

namespace tfdude {
namespace {

using testing::CliResult;
using testing::finish;
using testing::text;
using testing::ThesisDaemons;
using Arguments = std::vector<std::string>;

// The words without what they mean.
Arguments words_of(const std::string& answer) {
  Arguments words;
  std::istringstream lines(answer);
  for (std::string line; std::getline(lines, line);)
    words.push_back(line.substr(0, line.find('\t')));
  return words;
}

// The network options come first, as on a real command line.
CliResult complete(const testing::TestDomain& domain, const Arguments& words) {
  Arguments command{TFDUDE_CLI,  "__complete",
                    "--domain",  std::to_string(domain.number()),
                    "--profile", TFDUDE_LOOPBACK_PROFILE};
  command.insert(command.end(), words.begin(), words.end());
  testing::Process process(command);
  return finish(process);
}

bool has(const Arguments& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

}  // namespace

TEST_CASE("complete: commands, options and their values are those of the help") {
  const testing::TestDomain domain;
  const auto words = [&](const Arguments& line) { return words_of(complete(domain, line).out); };
  CHECK(words({"look"}) == Arguments{"lookup"});
  CHECK(has(words({""}), "keys"));
  CHECK(words({"keys", "re"}) == Arguments{"renew", "revoke"});
  CHECK(words({"lookup", "a", "b", "--at"}) == Arguments{"--at", "--at-b"});
  CHECK(has(words({"lookup", "--"}), "--json"));
  CHECK_FALSE(has(words({"keys", "check", "--"}), "--domain"));
  CHECK(words({"--clock", ""}) == Arguments{"system", "external"});
  CHECK(words({"--clock", "=", "e"}) == Arguments{"external"});
  CHECK(words({"graph", "--out", ""}) == Arguments{":files"});
  CHECK(words({"keys", "check", ""}) == Arguments{":directories"});
  CHECK(words({"update", "tool", "--xyz", "1", "-2", "3", "--quat"}) == Arguments{"--quat"});
  CHECK(words({"update", "tool", "--xyz", "1", ""}).empty());
  CHECK(words({"add", ""}).empty());
}

TEST_CASE("complete: frames and partitions are those of the living system, within 150 ms") {
  const ThesisDaemons d;
  const auto words = [&](const Arguments& line) { return words_of(complete(d.domain, line).out); };
  using Clock = std::chrono::steady_clock;
  auto shortest = Clock::duration::max();
  for (int i = 0; i < 5; ++i) {
    const auto begin = Clock::now();
    (void)words({"lookup", ""});
    shortest = std::min(shortest, Clock::now() - begin);
  }
  CHECK(shortest < std::chrono::milliseconds(150));
  // On a busy machine one answer may come too late.
  const auto eventually_are = [&](const Arguments& line, const Arguments& expected) {
    return testing::eventually([&] { return words(line) == expected; });
  };
  CHECK(eventually_are({"lookup", "world", "arm"}, {"arm_1", "arm_2", "arm_left", "arm_right"}));
  CHECK(eventually_are({"add", "tool", "--parent", "cam"}, {"camera"}));
  CHECK(eventually_are({"forget", ""}, {"arms", "robot"}));
  CHECK(words({"lookup", "world", "camera", ""}).empty());
}

TEST_CASE("complete: nobody there is told within 150 ms, too") {
  const testing::TestDomain domain;
  using Clock = std::chrono::steady_clock;
  auto shortest = Clock::duration::max();
  for (int i = 0; i < 5; ++i) {
    const auto begin = Clock::now();
    CHECK(complete(domain, {"parent", ""}).out.empty());
    shortest = std::min(shortest, Clock::now() - begin);
  }
  CHECK(shortest < std::chrono::milliseconds(150));
}

TEST_CASE("complete: bash offers a name of the network as a word, and never runs it") {
  const ThesisDaemons d;
  const testing::TemporaryDirectory directory;
  const std::string file = directory.path() + "/ran";
  CHECK(text(d, {"add", "tool $(touch " + file + ")", "--parent", "camera"}) ==
        "added tool $(touch " + file + ")\n");
  const std::string script =
      directory.write("complete.bash", std::string("source ") + TFDUDE_COMPLETION + R"(
COMP_WORDS=(')" + TFDUDE_CLI + R"(' --domain )" +
                                           std::to_string(d.domain.number()) + " --profile " +
                                           TFDUDE_LOOPBACK_PROFILE + R"( parent to)
COMP_CWORD=6
compopt() { :; }
_tfdude
printf '%s\n' "${COMPREPLY[@]}"
)");
  CHECK(testing::eventually([&] {
    testing::Process bash({"/bin/bash", script});
    return finish(bash).out == "tool\\ \\$\\(touch\\ " + file + "\\)\n";
  }));
  CHECK_FALSE(std::filesystem::exists(file));
}

}  // namespace tfdude
