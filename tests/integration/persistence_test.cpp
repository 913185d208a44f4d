// The state that a daemon keeps when it is killed, and files that it does not overwrite.

#include <atomic>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <future>
#include <iterator>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/random.hpp"
#include "support/thesis.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::await_ready;
using testing::Clock;
using testing::ContainsSubstring;
using testing::eventually;
using testing::finish;
using testing::in_time;
using testing::Process;
using testing::Random;
using testing::TemporaryDirectory;
using testing::TestDomain;
using testing::x_of;

// A daemon that keeps its state, killed and started again at will.
struct Keeper {
  explicit Keeper(std::string text) : config(directory.write("config.yaml", text)) { start(); }

  void start(const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"--config", config, "--state", directory.path()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    daemon.emplace(domain.start_daemon(arguments));
    ready = await_ready(*daemon);
  }
  void restart() {
    daemon->kill();
    start();
  }
  [[nodiscard]] std::string file() const {
    return directory.path() + "/domain-" + std::to_string(domain.number()) + "/arms.sqlite";
  }

  TestDomain domain;
  TemporaryDirectory directory;
  std::string config;
  std::optional<Process> daemon;
  std::string ready;
};

constexpr const char* kArms = R"(partition: arms
frames:
  - {id: arm}
  - {id: hand, parent: arm, xyz: [10, 0, 0]}
)";

// "ok" once a lookup succeeds, or why the last one did not.
std::string answers(Client& client, const std::string& a, const std::string& b) {
  std::string last;
  (void)eventually([&] {
    const auto X_AB = client.lookup(a, b);
    last = X_AB ? "ok" : X_AB.error().message;
    return X_AB.has_value();
  });
  return last;
}

std::string content(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

TEST_CASE("persistence: acknowledged changes survive a kill at any instant") {
  Keeper arms(kArms);
  auto client = Client::open(arms.domain.options()).value();
  Random random(0x9e51);
  INFO("seed " << random.seed());
  int next = 0;
  std::vector<std::string> there;
  for (int round = 0; round < 5; ++round) {
    // The kill interrupts a call of another thread; the result of that call is unknown.
    auto other = std::async(std::launch::async, [domain = &arms.domain, round] {
      auto caller = Client::open(domain->options(Milliseconds(300))).value();
      for (int i = 0; i < 1000; ++i) {
        if (!caller.add("other_" + std::to_string(round) + "_" + std::to_string(i), "arm", {}))
          return;
      }
    });
    for (int i = 0; i < 20; ++i) {
      const int number = next++;
      const std::string id = "f" + std::to_string(number);
      REQUIRE(client.add(id, "hand", along_x(1)));
      REQUIRE(client.update(id, along_x(number)));
      if (number % 3 == 0) REQUIRE(client.move(id, "arm"));
      if (number % 5 == 0) {
        REQUIRE(client.remove(id));
      } else {
        there.push_back(id);
      }
    }
    arms.restart();
    other.wait();
    for (const std::string& id : there) {
      INFO("round " << round << ", frame " << id);
      const int number = std::stoi(id.substr(1));
      REQUIRE(answers(client, "arm", id) == "ok");
      const double far = number % 3 == 0 ? 0 : 10;
      REQUIRE(x_of(client.lookup("arm", id)) == far + number);
    }
    auto fresh = Client::open(arms.domain.options()).value();
    for (int gone = 0; gone < next; gone += 5)
      CHECK_FALSE(fresh.exists("f" + std::to_string(gone)));
  }
}

TEST_CASE("persistence: streamed values are stored and survive a kill") {
  Keeper arms(kArms);
  arms.daemon->kill();
  arms.start({"--save-every", "50"});
  auto client = Client::open(arms.domain.options()).value();
  const std::size_t before = content(arms.file() + "-wal").size();
  REQUIRE(client.publish({{"hand", along_x(77)}}));
  REQUIRE(eventually([&] { return x_of(client.lookup("arm", "hand")) == 77; }));
  // The log grows by what is stored.
  REQUIRE(eventually([&] { return content(arms.file() + "-wal").size() > before; }));
  arms.restart();
  REQUIRE(eventually([&] { return client.lookup("arm", "hand").has_value(); }));
  CHECK(x_of(client.lookup("arm", "hand")) == 77);
}

TEST_CASE("persistence: others see the frames all the time while their daemon restarts") {
  Keeper arms(kArms);
  auto client = Client::open(arms.domain.options()).value();
  REQUIRE(client.exists("hand"));
  arms.daemon->kill();
  std::atomic<bool> stop{false};
  std::size_t missing = 0;
  std::size_t looked = 0;
  std::string error;
  std::thread watcher([&] {
    for (; !stop; ++looked) {
      const auto frames = client.frames();
      if (!frames) error = frames.error().message;
      missing += frames && frames->size() == 2 ? 0U : 1U;
    }
  });
  arms.start();
  const bool back = eventually([&] { return client.lookup("arm", "hand").has_value(); });
  stop = true;
  watcher.join();
  CHECK(back);
  CHECK(looked > 0);
  CHECK(error == "");
  CHECK(missing == 0);
}

TEST_CASE("persistence: edited entries of a configuration override the stored state") {
  Keeper arms(kArms);
  {
    auto client = Client::open(arms.domain.options()).value();
    REQUIRE(client.update("hand", along_x(20)));
    REQUIRE(client.update("arm", along_x(30)));
    REQUIRE(client.add("tool", "hand", along_x(100)));
  }
  arms.config = arms.directory.write("edited.yaml", R"(partition: arms
frames:
  - {id: arm, stddev: [1, 1, 1, 1, 1, 1]}
  - {id: hand, parent: arm, xyz: [10, 0, 0]}
  - {id: eye, parent: arm}
)");
  arms.restart();
  CHECK_THAT(arms.ready, ContainsSubstring("frames=4"));
  auto client = Client::open(arms.domain.options()).value();
  CHECK(x_of(client.lookup("arm", "tool")) == 120);
  CHECK(client.exists("eye"));
}

TEST_CASE("persistence: a state that cannot be read stops the daemon and is not changed") {
  Keeper arms(kArms);
  // At an orderly end all is in the one file.
  arms.daemon->signal(SIGTERM);
  REQUIRE(arms.daemon->wait(in_time()) == 0);
  REQUIRE_FALSE(std::filesystem::exists(arms.file() + "-wal"));
  std::string names;
  SECTION("damaged") {
    std::ofstream(arms.file(), std::ios::binary) << "not a database";
    names = "is damaged";
  }
  SECTION("newer") {
    std::fstream file(arms.file(), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(60);
    file << std::string("\0\0\0\x63", 4);
    names = "has format 99";
  }
  const std::string before = content(arms.file());
  Process again =
      arms.domain.start_daemon({"--config", arms.config, "--state", arms.directory.path()});
  const auto result = finish(again);
  CHECK(result.status == 2);
  CHECK(result.out.empty());
  CHECK_THAT(result.err, ContainsSubstring(names));
  CHECK_THAT(result.err, ContainsSubstring(arms.file()));
  CHECK_THAT(result.err, ContainsSubstring("move it away"));
  CHECK(content(arms.file()) == before);
}

TEST_CASE("persistence: an owner that missed a removal removes its frames when it returns") {
  Keeper arms(kArms);
  const std::string tools =
      arms.directory.write("tools.yaml",
                           "partition: tools\nframes:\n  - {id: gripper, parent: hand}\n"
                           "  - {id: finger, parent: gripper}\n");
  const std::vector<std::string> arguments{"--config", tools, "--state", arms.directory.path()};
  auto gripper = arms.domain.start_daemon(arguments);
  await_ready(gripper);
  auto client = Client::open(arms.domain.options()).value();
  REQUIRE(eventually([&] { return client.lookup("arm", "finger").has_value(); }));
  gripper.kill();
  REQUIRE(eventually([&] { return !client.partitions().value().at(1).reachable; }));
  REQUIRE(client.remove("hand"));
  bool gone = true;
  SECTION("although the other owner restarted meanwhile") {
    arms.restart();
    const auto lost = client.lookup("arm", "finger");
    REQUIRE_FALSE(lost);
  }
  SECTION("unless the parent exists again") {
    REQUIRE(client.add("hand", "arm", along_x(5)));
    gone = false;
  }
  auto again = arms.domain.start_daemon(arguments);
  await_ready(again);
  CHECK(eventually([&] {
    return client.partitions().value().at(1).reachable && client.exists("gripper") != gone &&
           client.exists("finger") != gone;
  }));
  auto fresh = Client::open(arms.domain.options()).value();
  CHECK(fresh.exists("finger") != gone);
}

TEST_CASE("persistence: by default the state is kept below the XDG state directory") {
  const TestDomain domain;
  const TemporaryDirectory home;
  auto daemon = [&] {
    return Process({"/usr/bin/env", "XDG_STATE_HOME=" + home.path(), TFDUDE_DAEMON, "--partition",
                    "legs", "--domain", std::to_string(domain.number()), "--profile",
                    TFDUDE_LOOPBACK_PROFILE});
  }();
  await_ready(daemon);
  CHECK(std::filesystem::exists(home.path() + "/tfdude/domain-" + std::to_string(domain.number()) +
                                "/legs.sqlite"));
}

}  // namespace tfdude
