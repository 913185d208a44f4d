// When callbacks end: with their Subscription, their PendingLookup, and their Client.

#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <type_traits>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/transport/loopback.hpp"

#include "support/catch.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::eventually;

static_assert(!std::is_copy_constructible_v<Subscription>);

constexpr Milliseconds kForEver = Milliseconds::max();

struct Pair {
  Pair() : node(*Node::open(network.join(), "arm", {{"arm", "", {}}})) { open(); }
  void open() { client = std::make_unique<Client>(*Client::open(network.join())); }

  LoopbackNetwork network;
  Node node;
  std::unique_ptr<Client> client;
};

/// Runs an action on its own thread, and says whether it has ended.
class Aside {
 public:
  explicit Aside(const std::function<void()>& action)
      : ended_(std::async(std::launch::async, action)) {}
  [[nodiscard]] bool ended_within(std::chrono::milliseconds time) const {
    return ended_.wait_for(time) == std::future_status::ready;
  }

 private:
  std::future<void> ended_;
};

/// A callback that waits until it is released.
struct Held {
  std::atomic<bool> runs{false};
  std::promise<void> go;
  std::atomic<bool> over{false};

  void operator()() {
    runs = true;
    go.get_future().wait();
    over = true;
  }
};

}  // namespace

TEST_CASE("lifetimes: the waits of other threads can be ended before the client is") {
  Pair pair;
  Result<StampedTransform> X = fail(Errc::kTimeout, "not looked up yet");
  const auto begin = std::chrono::steady_clock::now();
  std::thread waits([&] { X = pair.client->lookup("arm", "nobody", {}, 60s); });
  pair.client->end_waits();
  waits.join();
  REQUIRE_FALSE(X);
  CHECK(X.error().code == Errc::kTransport);
  CHECK(pair.client->lookup("arm", "nobody", {}, 60s).error().code == Errc::kTransport);
  CHECK(std::chrono::steady_clock::now() - begin < 30s);
}

TEST_CASE("lifetimes: closing a client ends what its callbacks wait for") {
  Pair pair;
  const int what = GENERATE(0, 1, 2, 3);
  REQUIRE(pair.node.add("hand", "arm", {}));
  std::atomic<bool> begun{false};
  std::optional<Error> got;
  const auto note = [&](const auto& result) {
    if (!result) got = result.error();
  };
  auto pending = pair.client->lookup_async("arm", "hand", {}, kForEver, [&](const auto&) {
    Client& client = *pair.client;
    auto watch = client.watch("arm", "hand");
    if (!watch || !watch->wait_next(20s)) return;
    begun = true;
    if (what == 0) note(client.lookup_many("arm", {"nobody"}, {}, 20s).front());
    if (what == 1) note(watch->wait_next(20s));
    if (what == 2) note(client.wait_until(client.now().value() + 1h, 20s));
    if (what == 3) note(client.histories("nowhere", 20s));
  });
  REQUIRE(eventually([&] { return begun.load(); }));
  const auto begin = std::chrono::steady_clock::now();
  pair.client.reset();
  CHECK(std::chrono::steady_clock::now() - begin < 10s);
  REQUIRE(got);
  constexpr Errc kExpected[] = {Errc::kUnknownEnd, Errc::kTransport, Errc::kTransport,
                                Errc::kUnknownPartition};
  CHECK(got->code == kExpected[what]);
}

TEST_CASE("lifetimes: no listener runs after its client has ended even if changes wait") {
  Pair pair;
  std::atomic<int> called{0};
  Held held;
  auto listening = pair.client->on_change([&](const Change&) {
    if (++called == 1) held();
  });
  for (int i = 0; i < 10; ++i) REQUIRE(pair.node.add("f" + std::to_string(i), "arm", {}));
  REQUIRE(eventually([&] { return held.runs.load(); }));
  const Aside closing([&] { pair.client.reset(); });
  CHECK_FALSE(closing.ended_within(20ms));
  held.go.set_value();
  REQUIRE(closing.ended_within(30s));
  CHECK(held.over);
  CHECK(called == 1);
  REQUIRE(pair.node.add("more", "arm", {}));
  pair.open();
  REQUIRE(eventually([&] { return pair.client->exists("more"); }));
  CHECK(called == 1);
  listening = Subscription();
}

TEST_CASE("lifetimes: a listener may end its client and its subscription") {
  Pair pair;
  std::optional<Subscription> listening;
  std::atomic<int> called{0};
  std::promise<void> subscribed;
  std::promise<void> done;
  listening.emplace(pair.client->on_change([&](const Change&) {
    if (++called > 1) return;
    subscribed.get_future().wait();
    pair.client.reset();
    listening.reset();
    done.set_value();
  }));
  subscribed.set_value();
  REQUIRE(pair.node.add("one", "arm", {}));
  REQUIRE(pair.node.add("two", "arm", {}));
  done.get_future().wait();
  CHECK(called == 1);
}

TEST_CASE("lifetimes: an ended subscription releases what its listener holds") {
  Pair pair;
  const auto thing = std::make_shared<int>(0);
  std::atomic<bool> heard{false};
  auto listening = pair.client->on_change([&heard, thing](const Change&) { heard = true; });
  REQUIRE(pair.node.add("one", "arm", {}));
  REQUIRE(eventually([&] { return heard.load(); }));
  listening = Subscription();
  CHECK(thing.use_count() == 1);
  const auto other = pair.client->on_change([&heard, thing](const Change&) { heard = true; });
  pair.client.reset();
  CHECK(thing.use_count() == 1);
}

TEST_CASE("lifetimes: cancelling a lookup and ending its client wait for the callback") {
  Pair pair;
  Held held;
  auto pending =
      pair.client->lookup_async("arm", "arm", {}, kForEver, [&](const auto&) { held(); });
  REQUIRE(eventually([&] { return held.runs.load(); }));
  {
    const Aside cancelling([&] { pending.cancel(); });
    CHECK_FALSE(cancelling.ended_within(20ms));
    held.go.set_value();
    REQUIRE(cancelling.ended_within(30s));
    CHECK(held.over);
  }
  // Also if the callback has cancelled itself before.
  Held after;
  PendingLookup self;
  std::promise<void> assigned;
  self = pair.client->lookup_async("arm", "arm", {}, kForEver, [&](const auto&) {
    assigned.get_future().wait();
    self.cancel();
    after();
  });
  assigned.set_value();
  REQUIRE(eventually([&] { return after.runs.load(); }));
  const Aside closing([&] { pair.client.reset(); });
  CHECK_FALSE(closing.ended_within(20ms));
  after.go.set_value();
  REQUIRE(closing.ended_within(30s));
  CHECK(after.over);
}

TEST_CASE("lifetimes: the end of a client drops callbacks and answers futures") {
  Pair pair;
  std::atomic<int> called{0};
  const auto thing = std::make_shared<int>(0);
  auto future = pair.client->lookup_async("arm", "nobody", {}, kForEver);
  auto pending = pair.client->lookup_async("arm", "nobody", {}, kForEver,
                                           [&called, thing](const auto&) { ++called; });
  pair.client.reset();
  REQUIRE(future.wait_for(0s) == std::future_status::ready);
  CHECK(future.get().error().code == Errc::kTransport);
  CHECK(thing.use_count() == 1);
  REQUIRE(pair.node.add("nobody", "arm", {}));
  pending.cancel();
  CHECK(called == 0);
}

TEST_CASE("lifetimes: a callback may end its own client") {
  for (int round = 0; round < 20; ++round) {
    Pair pair;
    std::promise<void> assigned;
    std::promise<void> done;
    PendingLookup pending;
    auto other = pair.client->lookup_async("arm", "nobody", {}, kForEver, [](const auto&) {});
    const auto listening = pair.client->on_change([](const Change&) {});
    pending = pair.client->lookup_async("arm", "arm", {}, kForEver, [&](const auto&) {
      assigned.get_future().wait();
      pair.client.reset();
      done.set_value();
    });
    assigned.set_value();
    done.get_future().wait();
    CHECK(pair.client == nullptr);
  }
  // A callback is destroyed with all that it holds, even with the client.
  Pair pair;
  std::shared_ptr<Client> shared = std::move(pair.client);
  const std::weak_ptr<Client> alive = shared;
  Client& client = *shared;
  auto pending =
      client.lookup_async("arm", "later", {}, kForEver, [held = std::move(shared)](const auto&) {});
  REQUIRE(pair.node.add("later", "arm", {}));
  CHECK(eventually([&] { return alive.expired(); }));
}

TEST_CASE("lifetimes: the function of a watch may hold the last client") {
  const bool of_partition = GENERATE(false, true);
  Pair pair;
  std::shared_ptr<Client> shared = std::move(pair.client);
  const std::weak_ptr<Client> alive = shared;
  REQUIRE(pair.node.add("hand", "arm", {}));
  REQUIRE(eventually([&] { return shared->exists("hand"); }));
  const auto hold = [&] { return [held = shared](const auto&) {}; };
  if (of_partition) {
    PartitionWatchOptions options;
    options.on_news = hold();
    REQUIRE(shared->watch_partition("arm", options));
  } else {
    WatchOptions options;
    options.on_route = hold();
    REQUIRE(shared->watch("arm", "hand", options));
  }
  shared.reset();
  CHECK(eventually([&] { return alive.expired(); }));
}

TEST_CASE("lifetimes: callbacks start and end each other concurrently") {
  // For ThreadSanitizer and AddressSanitizer.
  for (int round = 0; round < 30; ++round) {
    Pair pair;
    std::atomic<bool> stopping{false};
    std::thread adding([&] {
      for (int i = 0; !stopping; ++i) {
        const std::string id = "f" + std::to_string(i % 5);
        (void)pair.node.add(id, "arm", {});
        (void)pair.node.remove(id);
      }
    });
    std::thread asking([&, client = pair.client.get()] {
      for (int i = 0; i < 50; ++i) {
        const auto listening = client->on_change([&](const Change& change) {
          (void)client->lookup_async("arm", change.frame, {}, 5ms, [](const auto&) {});
        });
        auto first = client->lookup_async("arm", "f1", {}, kForEver,
                                          [&](const auto&) { (void)client->exists("f2"); });
        auto second =
            client->lookup_async("arm", "f2", {}, kForEver, [&](const auto&) { first.cancel(); });
        (void)client->lookup("arm", "f3", {}, 1ms);
        second.cancel();
      }
    });
    asking.join();
    pair.client.reset();
    stopping = true;
    adding.join();
  }
}

}  // namespace tfdude
