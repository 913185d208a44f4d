// Concurrent changes of owners that contradict each other, and the reports of them, over each
// transport.

#include <array>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/late_pages.hpp"
#include "support/networks.hpp"

namespace tfdude {
namespace {

using testing::ContainsSubstring;
using testing::Join;
using testing::joined_by;

constexpr std::chrono::seconds kLong{20};

/// Hears all changes and lets tests wait for them.
class Listener {
 public:
  explicit Listener(Client& client)
      : subscription_(client.on_change([this](const Change& change) {
          {
            const std::lock_guard lock(mutex_);
            heard_.push_back(change);
          }
          changed_.notify_all();
        })) {}

  template <class Condition>
  [[nodiscard]] bool hears(Condition condition) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kLong,
                             [&] { return std::any_of(heard_.begin(), heard_.end(), condition); });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Change> heard_;
  Subscription subscription_;  // last: it ends before the other members
};

std::vector<std::string> structure(Client& client) {
  std::vector<std::string> lines;
  const auto frames = client.frames().value();
  for (const Frame& frame : frames) {
    lines.push_back(frame.id + " < " + frame.parent + " @ " + frame.partition);
  }
  return lines;
}

struct Pair {
  explicit Pair(const Join& join)
      : arms(Node::open(join("arms"), "arms", {{"arm", "", {}}}).value()),
        head(Node::open(join("head"), "head", {{"neck", "", {}}}).value()),
        idle(Node::open(join("idle"), "idle", {}).value()),
        client(Client::open(join("")).value()) {
    // The owner that started first hears of the other a moment later.
    REQUIRE(agree());
    REQUIRE(client.exists("arm"));
    REQUIRE(client.exists("neck"));
  }

  [[nodiscard]] bool agree() {
    const auto end = std::chrono::steady_clock::now() + kLong;
    while (structure(arms) != structure(head) || structure(arms) != structure(client)) {
      if (std::chrono::steady_clock::now() > end) return false;
      std::this_thread::sleep_for(Milliseconds(2));
    }
    return true;
  }

  Node arms;
  Node head;
  Node idle;  // has no frames, and must not keep the others from agreeing
  Client client;
};

/// Makes both changes at the same instant. @return whether both succeeded
template <class First, class Second>
bool at_once(First first, Second second) {
  std::atomic<int> ready{0};
  const auto start = [&] {
    ++ready;
    while (ready < 2) std::this_thread::yield();
  };
  bool other = false;
  std::thread thread([&] {
    start();
    other = second();
  });
  start();
  const bool one = first();
  thread.join();
  return one && other;
}

bool is_conflict(const Change& change) { return change.kind == ChangeKind::kConflict; }

}  // namespace

TEST_CASE("two partitions add one id at once: one wins everywhere and a conflict is reported") {
  const int transport = GENERATE(from_range(testing::networks()));
  Pair p(joined_by(transport));
  std::vector<Client*> all{&p.arms, &p.head, &p.client};
  Listener arms(p.arms);
  Listener head(p.head);
  Listener client(p.client);
  std::string id;
  for (int round = 0; round < 500 && id.empty(); ++round) {
    const std::string next = "camera_" + std::to_string(round);
    const bool both = at_once([&] { return p.arms.add(next, "arm", {}).has_value(); },
                              [&] { return p.head.add(next, "neck", {}).has_value(); });
    if (both) id = next;
  }
  REQUIRE_FALSE(id.empty());
  REQUIRE(p.agree());
  const auto about = [&](const Change& change) {
    return is_conflict(change) && change.frame == id;
  };
  CHECK((head.hears(about) || arms.hears(about)));
  CHECK(client.hears(about));
  CHECK(p.client.lookup("arm", id).has_value() != p.client.lookup("neck", id).has_value());
}

TEST_CASE("two moves at once form a cycle: one move wins everywhere and a conflict is reported") {
  const int transport = GENERATE(from_range(testing::networks()));
  Pair p(joined_by(transport));
  Listener client(p.client);
  bool both = false;
  for (int round = 0; round < 500 && !both; ++round) {
    both = at_once([&] { return p.arms.move("arm", "neck").has_value(); },
                   [&] { return p.head.move("neck", "arm").has_value(); });
    if (both) break;
    // One was rejected: undoes it, and tries again.
    REQUIRE(p.arms.move("arm", ""));
    REQUIRE(p.head.move("neck", ""));
    REQUIRE(p.agree());
  }
  REQUIRE(both);
  REQUIRE(p.agree());
  CHECK(client.hears(is_conflict));
  const auto lines = structure(p.client);
  const bool arm_won = lines == std::vector<std::string>{"arm < neck @ arms", "neck <  @ head"};
  const bool neck_won = lines == std::vector<std::string>{"arm <  @ arms", "neck < arm @ head"};
  CHECK((arm_won || neck_won));
  CHECK(p.client.lookup("arm", "neck"));
}

TEST_CASE("a listener may call the client and hears nothing after its subscription ends") {
  const int transport = GENERATE(from_range(testing::networks()));
  Pair p(joined_by(transport));
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::string> seen;
  Subscription subscription = p.client.on_change([&](const Change& change) {
    if (change.kind != ChangeKind::kFrameAdded) return;
    const auto X = p.client.lookup("arm", change.frame);
    if (change.frame == "tool") (void)p.client.add("answer", "tool", {});
    {
      const std::lock_guard lock(mutex);
      seen.push_back(change.frame + (X ? " found" : " not found"));
    }
    changed.notify_all();
  });
  REQUIRE(p.arms.add("tool", "arm", {}));
  {
    std::unique_lock lock(mutex);
    CHECK(changed.wait_for(lock, kLong, [&] { return seen.size() == 2; }));
    CHECK(seen == std::vector<std::string>{"tool found", "answer found"});
  }
  subscription = Subscription();
  REQUIRE(p.arms.add("late", "arm", {}));
  REQUIRE(p.agree());
  const std::lock_guard lock(mutex);
  CHECK(seen.size() == 2);
}

TEST_CASE("an owner receives events of changes to its own frames") {
  const int transport = GENERATE(from_range(testing::networks()));
  Pair p(joined_by(transport));
  Listener arms(p.arms);
  REQUIRE(p.arms.add("tool", "arm", {}));
  REQUIRE(p.agree());
  REQUIRE(p.head.remove("tool"));
  const auto of = [](ChangeKind kind) {
    return [kind](const Change& change) { return change.kind == kind && change.frame == "tool"; };
  };
  CHECK(arms.hears(of(ChangeKind::kFrameAdded)));
  CHECK(arms.hears(of(ChangeKind::kFrameRemoved)));
}

TEST_CASE("a withdrawn claim takes no frame from others even if the withdrawal arrives late") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  auto late_transport = std::make_unique<testing::LatePages>(join("head"));
  testing::LatePages& late = *late_transport;
  Options options;
  options.timeout = Milliseconds(300);
  const Node arms = Node::open(join("arms"), "arms", {{"arm", "", {}}}).value();
  Node head = Node::open(std::move(late_transport), "head", {{"neck", "", {}}}, options).value();
  Client client = Client::open(join("")).value();
  REQUIRE(client.exists("neck"));
  late.hold("arms");
  REQUIRE(client.add("camera", "arm", {}));
  REQUIRE(client.remove("camera"));
  REQUIRE(client.add("camera", "neck", {}));
  late.let_one_through();
  REQUIRE(late.wait_until_asked(kLong));
  // The answer says that more pages will come, so the state stays the same, however long that
  // takes.
  std::this_thread::sleep_for(3 * options.timeout);
  CHECK(head.path("neck", "camera").has_value());
  late.let_through();
  REQUIRE(client.lookup("neck", "camera"));
  CHECK(client.update("camera", {}));
}

}  // namespace tfdude
