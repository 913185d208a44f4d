// Calls of several requests that wait: an owner that leaves between two of them, and is there again
// a moment later, is waited for as by one lookup.

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/transport/loopback.hpp"

#include "support/catch.hpp"
#include "support/process.hpp"
#include "support/relay.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::eventually;

constexpr auto kWait = 20s;

Transform ahead(double x) {
  return Transform::exact(Pose::trusted(Eigen::Quaterniond::Identity(), {x, 0, 0}));
}

Time instant(int ms) { return Time(std::chrono::seconds(1'000'000)) + Milliseconds(ms); }

// Loses the owner with one of the client's requests, and hears it again then.
class Interrupted final : public testing::Relay {
 public:
  using Relay::Relay;
  ~Interrupted() override { join(); }

  /// @param request  that is lost, counted from one
  void lose_with(int request) {
    join();
    const std::lock_guard lock(mutex_);
    lost_ = false;
    left_ = request;
  }
  [[nodiscard]] bool has_lost() {
    const std::lock_guard lock(mutex_);
    return lost_;
  }

 private:
  using Relay::send;
  Result<void> send(const std::string& partition, const Request& request,
                    Deadline deadline) override {
    {
      const std::lock_guard lock(mutex_);
      if (--left_ == 0) {
        lost_ = true;
        leave();
        return {};
      }
    }
    return Relay::send(partition, request, deadline);
  }
  // Under the lock; once until the next join().
  void leave() {
    leaves_ = std::thread([this] {
      const Presence there = this->there();
      on_lost(there.partition, there.incarnation, {});
      Relay::on_presence(there);
    });
  }
  void on_presence(const Presence& presence) override {
    {
      const std::lock_guard lock(there_mutex_);
      there_ = presence;
    }
    Relay::on_presence(presence);
  }
  Presence there() {
    const std::lock_guard lock(there_mutex_);
    return there_;
  }
  void join() {
    std::thread leaves;
    {
      const std::lock_guard lock(mutex_);
      left_ = 0;
      std::swap(leaves, leaves_);
    }
    if (leaves.joinable()) leaves.join();
  }

  std::mutex mutex_;
  int left_ = 0;
  bool lost_ = false;
  std::thread leaves_;
  std::mutex there_mutex_;
  Presence there_;
};

}  // namespace

TEST_CASE("waiting: an owner that leaves between the requests of a call is waited for again") {
  LoopbackNetwork network;
  Node node = Node::open(network.join(), "arm",
                         {{"world", "", {}}, {"arm", "world", ahead(1)}, {"hand", "arm", ahead(1)}})
                  .value();
  for (int ms = 0; ms <= 200; ms += 10) REQUIRE(node.update("hand", ahead(ms), instant(ms)));
  auto relay = std::make_unique<Interrupted>(network.join());
  Interrupted& way = *relay;
  ClientOptions by_requests;
  by_requests.shared_memory = false;
  Client client = Client::open(std::move(relay), by_requests).value();
  REQUIRE(client.lookup("world", "hand", Query{}, kWait));

  Query at;
  at.at = instant(100);
  const std::vector<Time> instants{instant(50), instant(100), instant(150)};
  const Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 3);
  CloudQuery with_stamps;
  with_stamps.stamps = instants;
  CloudQuery over_fixed = with_stamps;
  over_fixed.fixed = "world";
  CloudQuery with_covariances = over_fixed;
  with_covariances.covariances = true;
  const auto error_of = [](const auto& result) {
    return result ? std::string("none") : result.error().message;
  };
  struct Call {
    const char* name;
    std::function<std::string()> run;
  };
  const std::vector<Call> calls{
      {"lookup", [&] { return error_of(client.lookup("world", "hand", at, kWait)); }},
      {"lookup of two instants",
       [&] { return error_of(client.lookup("hand", at, "arm", at, "world", kWait)); }},
      {"lookup_many",
       [&] {
         return error_of(client.lookup_many("world", {"arm", "hand"}, at, kWait).back());
       }},
      {"trajectory",
       [&] { return error_of(client.trajectory("world", "hand", instants, {}, kWait)); }},
      {"velocity",
       [&] {
         return error_of(client.velocity("world", "hand", {instant(100), 20ms}, kWait));
       }},
      {"transform",
       [&] { return error_of(client.transform("world", "hand", ahead(1), at, kWait)); }},
      {"transform_cloud",
       [&] {
         return error_of(client.transform_cloud("world", "hand", points, with_stamps, kWait));
       }},
      {"transform_cloud over a fixed frame",
       [&] { return error_of(client.transform_cloud("arm", "hand", points, over_fixed, kWait)); }},
      {"transform_cloud with covariances",
       [&] {
         return error_of(client.transform_cloud("arm", "hand", points, with_covariances, kWait));
       }},
      {"watch", [&] { return error_of(client.watch("world", "hand", {}, kWait)); }},
      {"watch_edges",
       [&] {
         return error_of(client.watch_edges({"arm", "hand"}, {}, kWait));
       }},
      {"history", [&] { return error_of(client.history("hand", kWait)); }},
      {"histories", [&] { return error_of(client.histories("arm", kWait)); }},
      {"joints", [&] { return error_of(client.joints("arm", kWait)); }},
  };
  for (const Call& call : calls) {
    INFO(call.name);
    int request = 0;
    bool lost = true;
    while (lost && request < 20) {
      way.lose_with(++request);
      CAPTURE(request);
      CHECK(call.run() == "none");
      lost = way.has_lost();
      way.lose_with(0);
      REQUIRE(eventually([&] { return client.lookup("world", "hand", at).has_value(); }));
    }
    CHECK(request > 1);
  }
}

}  // namespace tfdude
