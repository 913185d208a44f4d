// Beside others in one process: profiles of each participant's own, settings of the host that stay
// as they are.

#include <algorithm>
#include <atomic>
#include <fstream>
#include <future>
#include <iterator>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/domain_lease.hpp"
#include "support/intraprocess.hpp"
#include "support/own_sockets.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using testing::addresses_of;
using testing::eventually;
using testing::own_sockets;
using Sockets = std::set<std::string>;

constexpr const char* kAnyAddress = "00000000";
constexpr const char* kLoopbackAddress = "0100007F";

Options options_of(std::uint32_t domain, const std::string& profile = TFDUDE_LOOPBACK_PROFILE) {
  Options options;
  options.domain = domain;
  options.profile = profile;
  return options;
}

std::multiset<std::string> addresses_since(const Sockets& before) {
  const Sockets now = own_sockets();
  Sockets opened;
  std::set_difference(now.begin(), now.end(), before.begin(), before.end(),
                      std::inserter(opened, opened.end()));
  return addresses_of(opened);
}

// Reads and changes what the other owns, by several threads.
bool asks(Node& node, const std::string& own, const std::string& other) {
  std::vector<std::future<bool>> threads;
  for (int thread = 0; thread < 3; ++thread) {
    threads.push_back(std::async(std::launch::async, [&node, own, other, thread] {
      const std::string id = own + "_" + std::to_string(thread);
      for (int i = 0; i < 100; ++i) {
        if (!node.add(id, other, {}) || !node.update(id, {}) || !node.lookup(own, id)) return false;
        if (!node.publish({{id, {}}, {other, {}}}) || !node.remove(id)) return false;
      }
      return true;
    }));
  }
  return std::all_of(threads.begin(), threads.end(), [](auto& thread) { return thread.get(); });
}

class Count final : public fastdds::edds::LogConsumer {
 public:
  explicit Count(std::shared_ptr<std::atomic<int>> entries) : entries_(std::move(entries)) {}
  void Consume(const fastdds::edds::Log::Entry&) override { ++*entries_; }

 private:
  const std::shared_ptr<std::atomic<int>> entries_;
};

}  // namespace

TEST_CASE("beside: each client of a process has the sockets of its own profile") {
  const testing::DomainLease lease;
  const bool confined_first = GENERATE(true, false);
  const auto open_confined = [&] { return Client::open(options_of(lease.number())).value(); };
  const auto open_wide = [&] { return Client::open(options_of(lease.number(), "")).value(); };
  const Sockets before = own_sockets();
  std::multiset<std::string> confined;
  std::multiset<std::string> wide;
  if (confined_first) {
    const Client one = open_confined();
    confined = addresses_since(before);
    const Sockets between = own_sockets();
    const Client two = open_wide();
    wide = addresses_since(between);
  } else {
    const Client one = open_wide();
    wide = addresses_since(before);
    const Sockets between = own_sockets();
    const Client two = open_confined();
    confined = addresses_since(between);
  }
  CHECK(confined.count(kLoopbackAddress) > 0);
  CHECK(confined.count(kAnyAddress) == 0);
  CHECK(wide.count(kAnyAddress) > 0);
}

TEST_CASE("beside: an edited profile file is read again") {
  const testing::DomainLease lease;
  const testing::TemporaryDirectory directory;
  const std::string file = directory.path() + "/profile.xml";
  std::stringstream text;
  text << std::ifstream(TFDUDE_LOOPBACK_PROFILE).rdbuf();
  std::ofstream(file) << text.str();
  const Client first = Client::open(options_of(lease.number(), file)).value();
  const std::string confinement =
      "<interfaceWhiteList><address>127.0.0.1</address></interfaceWhiteList>";
  const auto at = text.str().find(confinement);
  REQUIRE(at != std::string::npos);
  std::ofstream(file) << text.str().erase(at, confinement.size());
  const Sockets between = own_sockets();
  const Client second = Client::open(options_of(lease.number(), file)).value();
  CHECK(addresses_since(between).count(kAnyAddress) > 0);
}

TEST_CASE("beside: a client keeps the process's log consumers and intraprocess delivery") {
  const testing::DomainLease lease;
  const auto entries = std::make_shared<std::atomic<int>>(0);
  fastdds::edds::Log::ClearConsumers();
  fastdds::edds::Log::RegisterConsumer(std::make_unique<Count>(entries));
  testing::set_intraprocess(testing::kIntraprocessUserData);
  {
    const Client client = Client::open(options_of(lease.number())).value();
    EPROSIMA_LOG_ERROR(TFDUDE_TEST, "said by the host");
    CHECK(eventually([&] { return *entries > 0; }));
    CHECK(testing::intraprocess() == testing::kIntraprocessUserData);
  }
  fastdds::edds::Log::Reset();
  testing::set_intraprocess(testing::kIntraprocessFull);
}

TEST_CASE("beside: two nodes of one process call each other with any intraprocess delivery") {
  const auto delivery = GENERATE(testing::kIntraprocessFull, testing::kIntraprocessUserData,
                                 testing::kIntraprocessOff);
  testing::set_intraprocess(delivery);
  const testing::DomainLease lease;
  auto arm =
      Node::open("arm", {{"world", "", {}}, {"arm", "world", {}}}, options_of(lease.number()))
          .value();
  auto leg =
      Node::open("leg", {{"hip", "world", {}}, {"leg", "hip", {}}}, options_of(lease.number()))
          .value();
  REQUIRE(eventually([&] { return arm.lookup("world", "leg") && leg.lookup("world", "arm"); }));
  auto by_arm = std::async(std::launch::async, [&] { return asks(arm, "arm", "leg"); });
  auto by_leg = std::async(std::launch::async, [&] { return asks(leg, "leg", "arm"); });
  CHECK(by_arm.get());
  CHECK(by_leg.get());
  testing::set_intraprocess(testing::kIntraprocessFull);
}

}  // namespace tfdude
