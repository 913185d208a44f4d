// Owners with a store and clients, all concurrent in one process: for ThreadSanitizer.

#include <algorithm>
#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/transport/loopback.hpp"

#include "support/catch.hpp"
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

}  // namespace

TEST_CASE("threads: owners with a store and clients agree after concurrent changes") {
  const TemporaryDirectory directory;
  Options options;
  options.state = directory.path();
  options.save_every = Milliseconds(1);
  options.timeout = Milliseconds(20000);
  LoopbackNetwork network;
  std::vector<std::string> wrong(kCallers +
                                 1);  // what should have succeeded and did not, a caller each
  std::atomic<int> told{0};
  {
    auto arms = *Node::open(network.join(), "arms", {{"arm", "", {}}}, options);
    auto head = *Node::open(network.join(), "head", {{"neck", "arm", {}}}, options);
    std::vector<Client> clients;
    for (int i = 0; i < kCallers; ++i) clients.push_back(*Client::open(network.join(), options));
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

}  // namespace tfdude
