// The programs and the library with keys, over real DDS: who is rejected what, and that a rejection
// changes nothing and disturbs nobody.

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/client/client.hpp"

#include "support/capture.hpp"
#include "support/catch.hpp"
#include "support/dds_participant.hpp"
#include "support/key_store.hpp"
#include "support/stranger.hpp"
#include "support/test_domain.hpp"
#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/peers.hpp"

namespace tfdude {
namespace {

namespace fs = std::filesystem;

using namespace std::chrono_literals;

using nlohmann::json;
using testing::CliResult;
using testing::ContainsSubstring;
using testing::daemon_of;
using testing::DdsParticipant;
using testing::eventually;
using testing::looking;
using testing::moving;
using testing::Process;
using testing::streaming;
using testing::TemporaryDirectory;
using testing::TestDomain;
using testing::TestKeys;
using Arguments = std::vector<std::string>;

Time now() {
  return std::chrono::time_point_cast<Time::duration>(std::chrono::system_clock::now());
}

Transform along_x(double x) {
  return {*Pose::create(Eigen::Quaterniond::Identity(), {x, 0, 0}), {}};
}

const std::string kArm =
    "partition: arm\nframes:\n  - {id: secret_forearm, parent: base, xyz: [1, 0, 0]}\n";
const std::string kBase = "partition: base\nframes:\n  - {id: base}\n";

/// Two daemons with keys of one authority.
class SecuredRobot {
 public:
  explicit SecuredRobot(bool encrypt = true) : keys(now(), {encrypt, {0, 232}}) {
    keys.add("arm", daemon_of("arm"));
    keys.add("base", daemon_of("base"));
    keys.add("eye", looking());
    keys.add("mover", moving("arm"));
    arm.emplace(start("arm", kArm));
    base.emplace(start("base", kBase));
    testing::await_ready(*arm);
    testing::await_ready(*base);
  }

  [[nodiscard]] Process start(const std::string& identity, const std::string& config) const {
    return domain.start_daemon(
        {"--keys", keys.path(identity), "--config", files.write(identity + ".yaml", config)});
  }

  /// The command line with these keys; empty: without.
  [[nodiscard]] CliResult cli(const std::string& keys_of, Arguments arguments) const {
    if (!keys_of.empty()) arguments.insert(arguments.begin(), {"--keys", keys_of});
    return domain.cli(arguments);
  }
  [[nodiscard]] CliResult as(const std::string& identity, const Arguments& arguments) const {
    return cli(keys.path(identity), arguments);
  }

  [[nodiscard]] Result<Client> client(const std::string& identity) const {
    Options options = domain.options();
    options.keys = keys.path(identity);
    return Client::open(options);
  }

  /// Where the frame is, as who may look sees it.
  [[nodiscard]] double x_of_fore() const {
    auto client = this->client("eye");
    const auto X = client->lookup("base", "secret_forearm");
    return X ? X->pose.translation().x() : -1;
  }

  TestDomain domain;
  TestKeys keys;
  TemporaryDirectory files;
  std::optional<Process> arm;
  std::optional<Process> base;
};

// The error of a command that must be rejected, by its code.
std::string refused(const CliResult& result, const std::string& code) {
  CAPTURE(result.out, result.err);
  CHECK(result.status != 0);
  const std::string& text = result.err.empty() ? result.out : result.err;
  const auto at = text.find('{');
  if (at == std::string::npos) return text;
  const json error = json::parse(text.substr(at)).at("error");
  CHECK(error.at("code").get<std::string>() == code);
  return error.at("message").get<std::string>();
}

}  // namespace

TEST_CASE("keys: tfduded --check tells until when keys are valid, and whether they fit") {
  const SecuredRobot robot;
  const auto check = [&](const std::string& identity) {
    const std::string config = robot.files.write("checked.yaml", kArm);
    Process process = robot.domain.start_daemon(
        {"--check", "--no-state", "--keys", robot.keys.path(identity), "--config", config});
    return testing::finish(process);
  };
  const CliResult fits = check("arm");
  CHECK(fits.status == 0);
  CHECK_THAT(fits.out, ContainsSubstring("identity 'arm', valid until 2"));
  for (const char* other : {"base", "eye"}) {
    const CliResult refused = check(other);
    CHECK(refused.status == 2);
    CHECK_THAT(refused.err, ContainsSubstring("is not the daemon of this partition"));
  }
}

// Fast DDS 2.9 handles unprotected messages of any endpoint.
TEST_CASE("keys: huge ranges of sequence numbers silence no daemon") {
  SecuredRobot robot(GENERATE(true, false));
  testing::Stranger stranger(robot.domain.number());
  for (int i = 0; i < 3; ++i) {
    testing::send_huge_ranges(stranger, stranger.await_participants(2));
    CHECK(robot.as("eye", {"lookup", "base", "secret_forearm"}).status == 0);
  }
  for (Process* daemon : {&*robot.arm, &*robot.base}) {
    daemon->signal(SIGTERM);
    CHECK(daemon->wait(testing::Clock::now() + 5s) == 0);
  }
}

TEST_CASE("keys: each role may do what it says, and is told at once what it may not") {
  const SecuredRobot robot;
  CHECK(robot.as("eye", {"lookup", "base", "secret_forearm"}).status == 0);
  const std::string looker =
      refused(robot.as("eye", {"--json", "remove", "secret_forearm"}), "not_permitted");
  CHECK(looker == "identity 'eye' may not remove frame 'secret_forearm' in partition 'arm'");

  auto mover = robot.client("mover");
  REQUIRE(mover);
  const Transform X = along_x(2);
  CHECK(mover->update("secret_forearm", X));
  CHECK(robot.x_of_fore() == 2);
  const auto other = mover->update("base", X);
  REQUIRE_FALSE(other);
  CHECK(other.error().code == Errc::kNotPermitted);
  CHECK_THAT(other.error().message, ContainsSubstring("'mover'") && ContainsSubstring("'base'") &&
                                        ContainsSubstring("update"));
  CHECK(mover->publish({{"secret_forearm", X}}));
  const auto stream = mover->publish({{"base", X}});
  REQUIRE_FALSE(stream);
  CHECK(stream.error().code == Errc::kNotPermitted);
  CHECK(robot.x_of_fore() == 2);
}

TEST_CASE("keys: doctor finds keys that do not fit, and those about to expire") {
  SecuredRobot robot;
  const auto codes = [&](const std::string& keys_of) {
    const CliResult result = robot.cli(keys_of, {"--json", "doctor"});
    INFO(result.out << result.err);
    const json answer = json::parse(result.out);
    std::set<std::string> found;
    for (const json& finding : answer.at("findings")) {
      found.insert(finding.at("code").get<std::string>());
    }
    // They depend on the computer that runs the test, and on other tests there.
    for (const char* other : {"buffers", "domain", "firewall"}) found.erase(other);
    return found;
  };
  using Codes = std::set<std::string>;
  CHECK(codes(robot.keys.path("eye")).empty());
  robot.keys.add("hand", streaming("arm"));
  CHECK(codes(robot.keys.path("hand")).empty());  // it may not ask for the clock
  CHECK(codes("") == Codes{"keys_do_not_fit", "nobody"});
  TestKeys others(now());
  others.add("eye", looking());
  CHECK(codes(others.path("eye")) == Codes{"keys_do_not_fit", "nobody"});
  CHECK(codes(robot.files.path() + "/none") == Codes{"keys_invalid", "nobody"});
  REQUIRE(renew_identity(robot.keys.path(), "eye", Days(5), now()));
  CHECK(codes(robot.keys.path("eye")) == Codes{"keys_expire"});
}

TEST_CASE("keys: who may not look gets no memory of an owner") {
  const SecuredRobot robot;
  robot.keys.add("controller", streaming("arm"));
  // Of others, as this process owns nothing.
  const auto mapped = [] {
    std::ifstream maps("/proc/self/maps");
    std::size_t count = 0;
    for (std::string line; std::getline(maps, line);) {
      if (line.find("memfd:tfdude") != std::string::npos) ++count;
    }
    return count;
  };
  auto controller = robot.client("controller");
  REQUIRE(controller);
  REQUIRE(eventually([&] { return controller->exists("secret_forearm"); }));
  controller->find_memory();
  CHECK(mapped() == 0);
  for (const PartitionInfo& one : controller->partitions().value()) CHECK_FALSE(one.in_memory);
  auto eye = robot.client("eye");
  REQUIRE(eye);
  CHECK(eventually([&] {
    eye->find_memory();
    return mapped() == 2;
  }));
}

TEST_CASE("keys: who only streams sees the structure, streams, and asks nothing") {
  const SecuredRobot robot;
  robot.keys.add("controller", streaming("arm"));
  auto controller = robot.client("controller");
  REQUIRE(controller);
  CHECK(eventually([&] { return controller->exists("secret_forearm"); }));
  const Transform X = along_x(3);
  CHECK(controller->publish({{"secret_forearm", X}}));
  CHECK(eventually([&] { return robot.x_of_fore() == 3; }));
  const auto looked_up = controller->lookup("base", "secret_forearm");
  REQUIRE_FALSE(looked_up);
  CHECK(looked_up.error().code == Errc::kNotPermitted);
}

TEST_CASE("keys: without keys, or with those of others, nothing answers, and the reason is told") {
  const SecuredRobot robot;
  const std::string none =
      refused(robot.cli("", {"--json", "lookup", "base", "secret_forearm"}), "not_permitted");
  CHECK_THAT(none, ContainsSubstring("needs keys") && ContainsSubstring("TFDUDE_KEYS"));
  const TestKeys elsewhere(now());
  elsewhere.add("mover", moving("arm"));
  const std::string other = refused(
      robot.cli(elsewhere.path("mover"), {"--json", "remove", "secret_forearm"}), "not_permitted");
  CHECK_THAT(other, ContainsSubstring("another authority"));
  CHECK(robot.x_of_fore() == 1);
}

TEST_CASE("keys: expired and exchanged keys are rejected by name") {
  const SecuredRobot robot;
  const Time before = now() - Days(10);
  const TestKeys old(before);
  old.add("late", moving("arm"), Days(5));
  const std::string expired =
      refused(robot.cli(old.path("late"), {"--json", "remove", "secret_forearm"}), "config");
  CHECK_THAT(expired, ContainsSubstring("expired"));
  // Permissions of another identity.
  const TemporaryDirectory copy;
  const std::string stolen = copy.path() + "/eye";
  fs::copy(robot.keys.path("eye"), stolen);
  fs::copy_file(robot.keys.path("mover") + "/permissions.p7s", stolen + "/permissions.p7s",
                fs::copy_options::overwrite_existing);
  const std::string replayed =
      refused(robot.cli(stolen, {"--json", "remove", "secret_forearm"}), "config");
  CHECK_THAT(replayed, ContainsSubstring("is for the certificate"));
  // A participant that does not check its own keys.
  KeyFiles files = find_keys(robot.keys.path("eye"), now()).value();
  files.permissions = robot.keys.path("mover") + "/permissions.p7s";
  DdsParticipant liar(robot.domain.number(), &files);
  if (liar.good()) {
    auto* writer = liar.write<fastdds::RequestType>(kChangeTopic, "arm");
    std::this_thread::sleep_for(2s);
    CHECK((writer == nullptr || testing::readers_of(writer) == 0));
  }
  CHECK(robot.x_of_fore() == 1);
}

TEST_CASE("keys: a daemon may serve only its own partition") {
  const SecuredRobot robot;
  Process thief =
      robot.domain.start_daemon({"--keys", robot.keys.path("arm"), "--partition", "base"});
  CHECK(thief.wait(testing::in_time()).value_or(0) == 1);
  CHECK_THAT(thief.err(), ContainsSubstring("'arm' may not serve partition 'base'"));
  Process slash =
      robot.domain.start_daemon({"--keys", robot.keys.path("arm"), "--partition", "a/b"});
  CHECK(slash.wait(testing::in_time()).value_or(0) == 2);
  CHECK_THAT(slash.err(), ContainsSubstring("holds '/'"));
}

TEST_CASE("keys: nobody announces frames or presence in another's name") {
  const SecuredRobot robot;
  const KeyFiles arm = find_keys(robot.keys.path("arm"), now()).value();
  DdsParticipant forger(robot.domain.number(), &arm);
  REQUIRE(forger.good());
  auto* pages = forger.write_durable<fastdds::PageType>(kDirectoryTopic, "arm");
  auto* presences = forger.write_durable<fastdds::PresenceType>(kPresenceTopic, "arm");
  REQUIRE((pages != nullptr && presences != nullptr));
  auto eye = robot.client("eye");
  REQUIRE(eye);
  REQUIRE(eye->lookup("base", "secret_forearm"));
  REQUIRE(eventually(
      [&] { return testing::readers_of(pages) >= 3 && testing::readers_of(presences) >= 3; }));
  const auto forge = [&] {
    wire::Page page = fastdds::to_wire(Page{"base", 0, UINT64_MAX / 2, 9, {{"forged", "base"}}});
    wire::Presence presence =
        fastdds::to_wire(Presence{"base", UINT64_MAX / 2, "nowhere", 1, 1, true});
    CHECK(fastdds::write(*pages, &page));
    CHECK(fastdds::write(*presences, &presence));
  };
  forge();
  // A writer may change its DDS partition after it was matched.
  for (auto* writer : {pages, presences}) {
    auto* publisher = const_cast<fastdds::edds::Publisher*>(writer->get_publisher());
    fastdds::edds::PublisherQos qos = publisher->get_qos();
    qos.partition().clear();
    qos.partition().push_back("base");
    (void)publisher->set_qos(qos);
  }
  std::this_thread::sleep_for(1s);
  forge();
  // What is allowed arrives, after all that.
  wire::Page marker = fastdds::to_wire(Page{"arm", 7, 1, 9, {{"marker", "base"}}});
  (void)fastdds::write(*pages, &marker);
  std::this_thread::sleep_for(1s);
  CHECK_FALSE(eye->exists("forged"));
  const auto partitions = eye->partitions();
  REQUIRE(partitions);
  for (const PartitionInfo& partition : *partitions) CHECK(partition.host != "nowhere");
  CHECK(eye->lookup("base", "secret_forearm"));
  CHECK(robot.x_of_fore() == 1);
}

TEST_CASE("keys: encrypted messages show no frame's name") {
  if (!testing::Capture().good()) {
    WARN("SKIPPED: packets can be captured by root only");
    return;
  }
  for (const bool encrypt : {false, true}) {
    const testing::Capture capture;
    const SecuredRobot robot(encrypt);
    CHECK(robot.x_of_fore() == 1);
    // The names of the participants' partitions are not secret.
    const std::string bytes = capture.bytes();
    CHECK(bytes.find("RTPS") != std::string::npos);
    CHECK((bytes.find("secret_forearm") != std::string::npos) == !encrypt);
  }
}

// All that is left is then one participant that is not authenticated.
TEST_CASE("keys: a daemon lives on when all others but a stranger have left") {
  SecuredRobot robot;
  std::vector<Process> strangers;
  for (const std::string name : {"left", "right"}) {
    const std::string config = "partition: " + name + "\nframes:\n  - {id: " + name + "}\n";
    strangers.push_back(
        robot.domain.start_daemon({"--config", robot.files.write(name + ".yaml", config)}));
    testing::await_ready(strangers.back());
  }
  CHECK(robot.as("eye", {"lookup", "base", "secret_forearm"}).status == 0);
  for (Process* leaving : {&*robot.base, &strangers.front()}) {
    leaving->signal(SIGTERM);
    CHECK(testing::finish(*leaving).status == 0);
  }
  // Longer than the time between two announcements.
  const auto until = std::chrono::steady_clock::now() + 1s;
  bool both_run = true;
  CHECK(eventually([&] {
    both_run = both_run && robot.arm->runs() && strangers.back().runs();
    return std::chrono::steady_clock::now() > until;
  }));
  CHECK(both_run);
  CHECK(eventually([&] { return robot.as("eye", {"tree"}).status == 0; }));
}

TEST_CASE("keys: several processes may use one identity, and a daemon may restart") {
  SecuredRobot robot;
  Process first = robot.domain.start_cli(
      {"--keys", robot.keys.path("eye"), "lookup", "base", "secret_forearm"});
  Process second = robot.domain.start_cli(
      {"--keys", robot.keys.path("eye"), "lookup", "base", "secret_forearm"});
  CHECK(testing::finish(first).status == 0);
  CHECK(testing::finish(second).status == 0);
  auto eye = robot.client("eye");
  REQUIRE(eye->lookup("base", "secret_forearm"));
  robot.arm->kill();
  robot.arm.emplace(robot.start("arm", kArm));
  testing::await_ready(*robot.arm);
  CHECK(eventually([&] { return eye->lookup("base", "secret_forearm").has_value(); }));
}

// Fast DDS repeats a message of a handshake after a second. Where it drops such messages, 6 % of
// all meetings take so long (docs/transport.md): more than three of a hundred in six of seven runs.
// On a busy machine all meetings take longer, and some of them much longer.
TEST_CASE("keys: a new participant does not wait until a handshake is repeated") {
  const SecuredRobot robot;
  std::vector<std::chrono::milliseconds> meetings;
  for (int i = 0; i < 100; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    auto client = robot.client("eye");
    REQUIRE(client->lookup("base", "secret_forearm"));
    meetings.push_back(std::chrono::duration_cast<std::chrono::milliseconds>(
        std::chrono::steady_clock::now() - begin));
  }
  std::vector<std::chrono::milliseconds> sorted = meetings;
  std::sort(sorted.begin(), sorted.end());
  const auto usual = sorted[sorted.size() / 2];
  std::string slow;
  for (std::size_t i = 0; i < meetings.size(); ++i) {
    if (meetings[i] < usual + 900ms) continue;
    slow += " " + std::to_string(i) + ": " + std::to_string(meetings[i].count()) + " ms";
  }
  CAPTURE(usual.count(), slow);
  CHECK(sorted[sorted.size() - 4] < usual + 900ms);
}

}  // namespace tfdude
