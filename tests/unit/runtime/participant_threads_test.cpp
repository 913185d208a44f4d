// Owners with a store and clients, all concurrent in one process: for ThreadSanitizer.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/transport/loopback.hpp"

#include "support/catch.hpp"
#include "support/lossy_requests.hpp"
#include "support/process.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::eventually;
using testing::Random;
using testing::TemporaryDirectory;

constexpr int kCallers = 4;
constexpr int kCalls = 300;

std::vector<std::string> structure(Client& client) {
  std::vector<std::string> lines;
  const auto frames = client.frames().value();
  for (const Frame& frame : frames) {
    lines.push_back(frame.id + " < " + frame.parent + " @ " + frame.partition);
  }
  return lines;
}

// The work of one caller: on its own frames, where every call must succeed, and on a frame that all
// callers change.
void work(Client& client, const std::string& name, std::uint64_t seed, std::string& wrong) {
  Random random(seed);
  const auto expect = [&wrong](const auto& result) {
    if (!result && wrong.empty()) wrong = result.error().message;
  };
  for (int i = 0; i < kCalls; ++i) {
    const std::string id = name + "_" + std::to_string(i % 7);
    const std::string parent = random.index(2) == 0 ? "arm" : "neck";
    expect(client.add(id, parent, {}));
    expect(client.update(id, random.transform()));
    expect(client.lookup(parent, id));
    expect(client.publish({{id, random.transform()}}));
    (void)client.add("shared", parent, {});
    (void)client.move("shared", parent);
    (void)client.lookup("arm", "shared");
    (void)client.remove("shared");
    expect(client.move(id, parent == "arm" ? "neck" : "arm"));
    expect(client.remove(id));
  }
}

// Of all threads of this process.
std::multiset<std::string> thread_names() {
  std::multiset<std::string> names;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
    std::string name;
    std::getline(std::ifstream(thread.path() / "comm"), name);
    names.insert(name);
  }
  return names;
}

}  // namespace

TEST_CASE("threads: owners with a store and clients agree after concurrent changes") {
  const TemporaryDirectory directory;
  Options common;
  common.timeout = Milliseconds(20000);
  NodeOptions options = common;
  options.state = directory.path();
  options.save_every = Milliseconds(1);
  LoopbackNetwork network;
  std::vector<std::string> wrong(kCallers +
                                 1);  // what should have succeeded and did not, a caller each
  std::atomic<int> told{0};
  {
    auto arms = *Node::open(network.join(), "arms", {{"arm", "", {}}}, options);
    auto head = *Node::open(network.join(), "head", {{"neck", "arm", {}}}, options);
    std::vector<Client> clients;
    for (int i = 0; i < kCallers; ++i) clients.push_back(*Client::open(network.join(), common));
    const auto subscription = clients[0].on_change([&](const Change& change) {
      ++told;
      (void)clients[0].exists(change.frame);
    });
    const auto own = arms.on_change([&](const Change&) { ++told; });
    std::vector<std::thread> threads;
    for (int i = 0; i < kCallers; ++i) {
      threads.emplace_back([&, i] {
        work(clients[static_cast<std::size_t>(i)], "c" + std::to_string(i),
             static_cast<std::uint64_t>(i) + 1, wrong[static_cast<std::size_t>(i)]);
      });
    }
    threads.emplace_back([&] { work(arms, "own", 99, wrong[kCallers]); });
    for (std::thread& thread : threads) thread.join();
    const auto agree = [&] {
      return std::all_of(clients.begin(), clients.end(),
                         [&](Client& client) { return structure(client) == structure(arms); }) &&
             structure(head) == structure(arms);
    };
    CHECK(eventually(agree));
  }
  CHECK(wrong == std::vector<std::string>(kCallers + 1));
  CHECK(told > kCalls);
}

TEST_CASE("watch: own commits at its beginning are noticed while another owner is asked") {
  using Clock = std::chrono::steady_clock;
  using namespace std::chrono_literals;
  Options options;
  options.timeout = 200ms;
  Options pushes;
  pushes.shared_memory = false;
  auto best = Clock::duration::max();
  // The computer may be busy, so only the fastest try counts.
  for (int i = 0; i < 10 && best >= 500ms; ++i) {
    LoopbackNetwork network;
    // Its memory cannot be read, so it is asked.
    const Node mute =
        Node::open(network.join(), "mute", {{"m", "", {}}, {"n", "m", {}}}, pushes).value();
    std::atomic<int> asked{0};
    const auto loses = [&](const Request& request) {
      const bool watches = std::holds_alternative<WatchRequest>(request.body);
      if (watches) ++asked;
      return watches;
    };
    auto transport = std::make_unique<testing::LossyRequests>(network.join(), loses);
    Node node =
        Node::open(std::move(transport), "own", {{"a", "", {}}, {"b", "a", {}}}, options).value();
    REQUIRE(node.exists("n"));
    // A round waits for an answer. The next one begins with the own path, and waits again.
    std::thread first([&] { (void)node.watch("m", "n"); });
    CHECK(eventually([&] { return asked > 0; }));
    std::this_thread::sleep_for(options.timeout / 2);
    std::thread second([&] {
      std::this_thread::sleep_for(10ms);
      (void)node.watch("m", "n");
    });
    const auto watch = node.watch("a", "b");
    if (watch) {
      const auto messages = watch->messages();
      CHECK(node.update("b", {}, Time(1s)));
      const auto begin = Clock::now();
      CHECK(watch->wait_for_more(messages, begin + 20s));
      best = std::min(best, Clock::now() - begin);
    }
    for (std::thread* one : {&first, &second}) one->join();
  }
  CHECK(best < 500ms);
}

TEST_CASE("participant: it serves and watches and waits and listens on six named threads") {
  LoopbackNetwork network;
  const TemporaryDirectory directory;
  NodeOptions options;
  options.state = directory.path();
  Node head = Node::open(network.join(), "head", {{"head", "", {}}, {"eye", "head", {}}}).value();
  Node arm = Node::open(network.join(), "arm", {{"arm", "head", {}}, {"hand", "arm", {}}}, options)
                 .value();
  REQUIRE(eventually([&] { return thread_names().count("tfdude-commit") == 2; }));
  const auto before = thread_names();
  std::atomic<int> heard{0};
  std::vector<PartitionWatch> watched;
  PartitionWatchOptions news;
  news.on_news = [&](const PartitionNews&) { ++heard; };
  for (const char* name : {"arm", "head", "head"}) {
    watched.push_back(arm.watch_partition(name, news).value());
  }
  const auto path = arm.watch("head", "hand");
  REQUIRE(path);
  const auto listening = arm.on_change([&](const Change&) { ++heard; });
  const auto stream = arm.stream({"eye"});
  REQUIRE(stream);
  auto waiting = arm.lookup_async("head", "later", {}, Milliseconds::max());
  REQUIRE(head.add("later", "head", {}));
  REQUIRE(waiting.get());
  REQUIRE(eventually([&] { return heard >= 6; }));
  // Beside the transport's. The other one, whose edges are watched, pushes. Each has memory to pass
  // or to read.
  const std::multiset<std::string> expected{"tfdude-ask",    "tfdude-callback", "tfdude-calls",
                                            "tfdude-memory", "tfdude-memory",   "tfdude-push",
                                            "tfdude-push"};
  CHECK(eventually([&] {
    auto begun = thread_names();
    for (const std::string& name : before) {
      if (const auto known = begun.find(name); known != begun.end()) begun.erase(known);
    }
    return begun == expected;
  }));
}

}  // namespace tfdude
