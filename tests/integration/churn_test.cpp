// Many participants that come and go, some of them killed, while two partitions are asked all the
// time.

#include <atomic>
#include <csignal>
#include <deque>
#include <string>
#include <thread>
#include <vector>

#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/test_domain.hpp"
#include "support/thesis.hpp"

namespace tfdude {
namespace {

using testing::eventually;
using testing::Process;

// Asks and changes both partitions without a pause, from another process than theirs.
class Load {
 public:
  explicit Load(Client& client) : client_(client), thread_([this] { run(); }) {}
  ~Load() { stop(); }
  Load(const Load&) = delete;
  Load& operator=(const Load&) = delete;

  void stop() {
    stopping_ = true;
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] std::size_t calls() const { return calls_; }
  /// To be read after stop().
  [[nodiscard]] const std::string& first_error() const { return first_error_; }

 private:
  void run() {
    while (!stopping_) {
      note(client_.update({{"robot_2", {}}, {"arm_left", {}}}));
      note(client_.publish({{"camera", {}}, {"hand_left", {}}}));
      note(client_.lookup("camera", "hand_left"));
      ++calls_;
    }
  }
  template <class Value>
  void note(const Result<Value>& result) {
    if (!result && first_error_.empty()) first_error_ = result.error().message;
  }

  Client& client_;
  std::atomic<bool> stopping_{false};
  std::atomic<std::size_t> calls_{0};
  std::string first_error_;
  std::thread thread_;
};

}  // namespace

TEST_CASE("churn: fifty daemons and clients come and go under load without an error") {
  testing::Random random(50);
  INFO("seed " << random.seed());
  testing::ThesisDaemons d;
  auto client = Client::open(d.domain.options()).value();
  REQUIRE(client.lookup("camera", "hand_left"));
  testing::TemporaryDirectory directory;
  Load load(client);
  std::deque<Process> alive;
  for (int i = 0; i < 50; ++i) {
    const std::string name = "guest_" + std::to_string(i);
    if (i % 2 == 0) {
      const std::string config =
          "partition: " + name + "\nframes:\n  - {id: " + name + ", parent: arm_2}\n";
      alive.push_back(d.domain.start_daemon({"--config", directory.write(name + ".yaml", config)}));
    } else {
      alive.push_back(d.domain.start_cli({"watch", "world", "hand_left", "--rate", "50"}));
    }
    if (alive.size() < 8) continue;
    if (i % 2 == 0) testing::await_ready(alive.back());
    // The first that came goes, killed or told to.
    alive.front().signal(random.index(2) == 0 ? SIGKILL : SIGTERM);
    REQUIRE(eventually([&] { return !alive.front().runs(); }));
    alive.pop_front();
  }
  const std::size_t calls = load.calls();
  CHECK(eventually([&] { return load.calls() > calls; }));
  load.stop();
  CHECK(load.first_error() == "");
  CHECK(d.robot.runs());
  CHECK(d.arms->runs());
  CHECK(client.add("tool", "hand_left", {}));
}

}  // namespace tfdude
