// Fast DDS cannot create an entity: each call ends with an error that names the entity, and closing
// ends, too.

#include "transport/fastdds/creation.hpp"

#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <sys/resource.h>
#include <thread>
#include <unistd.h>
#include <utility>
#include <variant>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/domain_lease.hpp"
#include "support/forest_support.hpp"
#include "support/joint_frames.hpp"
#include "support/no_threads.hpp"
#include "support/process.hpp"
#include "types/topic_names.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::ContainsSubstring;

constexpr auto kTimeout = 3s;
// Of a call that fails, on a busy machine.
constexpr auto kLate = 20s;

/// While it exists, creations fail for which this returns true.
class Failing {
 public:
  explicit Failing(fastdds::FailCreation fails) { fastdds::fail_creations(std::move(fails)); }
  ~Failing() { fastdds::fail_creations(nullptr); }
  Failing(const Failing&) = delete;
  Failing& operator=(const Failing&) = delete;
};

/// While it exists, this process can open only so many files and sockets more.
class FewDescriptors {
 public:
  explicit FewDescriptors(int number) {
    const int next = dup(STDERR_FILENO);
    close(next);
    getrlimit(RLIMIT_NOFILE, &before_);
    const rlimit few{static_cast<rlim_t>(next + number), before_.rlim_max};
    setrlimit(RLIMIT_NOFILE, &few);
  }
  ~FewDescriptors() { setrlimit(RLIMIT_NOFILE, &before_); }
  FewDescriptors(const FewDescriptors&) = delete;
  FewDescriptors& operator=(const FewDescriptors&) = delete;

 private:
  rlimit before_{};
};

/// Counts what is created, and lets the one with this number fail.
struct Creations {
  explicit Creations(std::size_t number) : failing(number) {}
  bool fails(const std::string& what) {
    const std::lock_guard<std::mutex> lock(mutex);
    if (count++ != failing) return false;
    failed = what;
    return true;
  }

  const std::size_t failing;
  std::mutex mutex;
  std::size_t count = 0;
  std::string failed;
};

auto of_topic(const std::string& topic) {
  return [topic](const std::string& what) { return what.find(topic + " ") != std::string::npos; };
}

/// Runs a call on a thread of its own, so that the test fails if the call does not end.
template <class Call>
auto ends(Call call) {
  std::packaged_task<decltype(call())()> task(std::move(call));
  auto outcome = task.get_future();
  std::thread(std::move(task)).detach();
  if (outcome.wait_for(kLate) != std::future_status::ready) FAIL("the call does not end");
  return outcome.get();
}

Options options_in(const testing::DomainLease& lease) {
  Options options;
  options.domain = lease.number();
  options.profile = TFDUDE_LOOPBACK_PROFILE;
  options.timeout = kTimeout;
  return options;
}

/// Watched paths hear of changes by messages then, not by the owner's memory.
Options without_memory(Options options) {
  options.shared_memory = false;
  return options;
}

std::vector<FrameSpec> frames() {
  return {{"map", "", {}},
          {"base", "map", testing::along_x(1)},
          testing::moved_by("tip", "base", testing::revolute_named("elbow"))};
}

/// Opens and closes. @return the error of opening
using OpenAndClose = std::function<Result<void>(const Options&)>;

Result<void> a_node(const Options& options) {
  return Node::open("arm", frames(), options).map([](const Node&) {});
}

Result<void> a_client_with_clock(const Options& options) {
  Options external = options;
  external.clock = ClockKind::kExternal;
  return Client::open(external).map([](const Client&) {});
}

}  // namespace

TEST_CASE("creation: who cannot create an entity does not open, and says which") {
  const testing::DomainLease lease;
  const Options options = options_in(lease);
  const auto [least, open] =
      GENERATE(std::pair<std::size_t, OpenAndClose>{20, a_node},
               std::pair<std::size_t, OpenAndClose>{10, a_client_with_clock});
  const auto attempt = [&, open = open](Creations& creations) {
    const Failing failing([&](const std::string& what) { return creations.fails(what); });
    return ends([&, open] { return open(options); });
  };
  Creations all(1000);
  REQUIRE(attempt(all));
  CHECK(all.count >= least);
  for (std::size_t i = 0; i < all.count; ++i) {
    Creations creations(i);
    const auto opened = attempt(creations);
    CAPTURE(i, creations.failed);
    REQUIRE_FALSE(opened);
    CHECK(opened.error().code == Errc::kTransport);
    CHECK_THAT(opened.error().message,
               ContainsSubstring("Fast DDS could not create " + creations.failed));
  }
}

TEST_CASE("creation: what Fast DDS throws is an error, as its reason") {
  const testing::DomainLease lease;
  const Failing failing([](const std::string&) -> bool { throw std::runtime_error("no luck"); });
  const auto opened = ends([&] { return a_node(options_in(lease)); });
  REQUIRE_FALSE(opened);
  CHECK(opened.error().code == Errc::kTransport);
  CHECK_THAT(opened.error().message, ContainsSubstring(": no luck"));
}

TEST_CASE("creation: who gets no thread does not open, and does once there are some") {
  const testing::DomainLease lease;
  const Options options = options_in(lease);
  const OpenAndClose open = GENERATE(OpenAndClose(a_node), OpenAndClose(a_client_with_clock));
  const auto opened = ends([&] {
    const testing::NoThreads none;
    return open(options);
  });
  REQUIRE_FALSE(opened);
  CHECK(opened.error().code == Errc::kTransport);
  CHECK(ends([&] { return open(options); }));
}

TEST_CASE("creation: who gets too few descriptors to hear others does not open") {
  const testing::DomainLease lease;
  const Options options = without_memory(options_in(lease));
  const Node node = Node::open("arm", frames(), options).value();
  int opened = 0;
  constexpr int kMost = 24;
  for (int number = 1; number < kMost; ++number) {  // the profile is read, too
    CAPTURE(number);
    auto client = ends([&] {
      const FewDescriptors few(number);
      return Client::open(options);
    });
    if (client) {
      ++opened;
      CHECK(ends([&] { return client->lookup("map", "tip"); }));
    } else {
      CHECK(client.error().code == Errc::kTransport);
    }
  }
  CHECK(opened > 0);
  CHECK(opened < kMost - 1);
}

TEST_CASE("creation: a client that gets no thread returns errors, until it gets one") {
  const testing::DomainLease lease;
  Options options = without_memory(options_in(lease));
  options.timeout = 500ms;
  const Node node = Node::open("arm", frames(), options).value();
  auto client = std::make_unique<Client>(Client::open(options).value());
  REQUIRE(testing::eventually([&] { return client->exists("base"); }));
  ends([&] {
    const testing::NoThreads none;
    (void)client->lookup("map", "tip");
    (void)client->update("base", testing::along_x(2));
    (void)client->publish({{"base", testing::along_x(2)}});
    (void)client->publish_joints({"elbow"}, {0.5});
    return client->watch("map", "base").map([](const PathWatch&) {});
  });
  CHECK(testing::eventually([&] { return client->lookup("map", "tip").has_value(); }));
  CHECK(client->update("base", testing::along_x(2)));
  ends([&] {
    const testing::NoThreads none;
    client.reset();
  });
}

TEST_CASE(
    "creation: a client without writers to an owner returns errors, until it can create them") {
  const testing::DomainLease lease;
  const Options options = options_in(lease);
  const Node node = Node::open("arm", frames(), options).value();
  auto client = std::make_unique<Client>([&] {
    const Failing failing([](const std::string& what) {
      return of_topic(kRequestTopic)(what) || of_topic(kChangeTopic)(what);
    });
    Client opened = Client::open(options).value();
    CHECK_FALSE(opened.lookup("map", "tip"));
    return opened;
  }());
  const auto says = [](const Result<void>& outcome, const std::string& topic) {
    CAPTURE(topic);
    REQUIRE_FALSE(outcome);
    CHECK(outcome.error().code == Errc::kTransport);
    CHECK_THAT(outcome.error().message, ContainsSubstring(topic) && ContainsSubstring("'arm'"));
  };
  {
    const Failing failing([](const std::string&) { return true; });
    says(ends([&] { return client->lookup("map", "tip").map([](const Transform&) {}); }),
         kRequestTopic);
    says(ends([&] { return client->update("base", testing::along_x(2)); }), kChangeTopic);
    says(ends([&] { return client->publish({{"base", testing::along_x(2)}}); }), kUpdateTopic);
    says(ends([&] { return client->publish_joints({"elbow"}, {0.5}); }), kJointTopic);
    const auto clock = ends([&] { return client->publish_clock(ExternalTime(1s)); });
    REQUIRE_FALSE(clock);
    CHECK_THAT(clock.error().message, ContainsSubstring(kClockTopic));
    auto stream = client->stream({"base"}).value();
    const auto& not_sent = stream.try_publish({testing::along_x(2)});
    REQUIRE(not_sent.size() == 1);
    CHECK(not_sent.front().why == Errc::kTransport);
    CHECK(ends([&] { return client->flush(100ms); }));
  }
  CHECK(testing::eventually([&] { return client->lookup("map", "tip").has_value(); }));
  CHECK(client->update("base", testing::along_x(2)));
  CHECK(client->publish({{"base", testing::along_x(3)}}));
  CHECK(client->publish_clock(ExternalTime(1s)));
  {
    const Failing failing([](const std::string&) { return true; });
    ends([&] { client.reset(); });
  }
}

TEST_CASE("creation: an owner that cannot create a writer of replies answers once it can") {
  const testing::DomainLease lease;
  const Options options = options_in(lease);
  const Node node = Node::open("arm", frames(), options).value();
  auto client = Client::open(options).value();
  {
    const Failing failing(of_topic(kReplyTopic));
    Options hasty = options;
    hasty.timeout = 500ms;
    auto fresh = Client::open(hasty);  // its reader of replies cannot be created either
    CHECK_FALSE(fresh);
    const auto X = ends([&] { return client.lookup("map", "tip"); });
    if (!X) CHECK(X.error().code == Errc::kTimeout);  // unless the writer was there already
  }
  CHECK(testing::eventually([&] { return client.lookup("map", "tip").has_value(); }));
}

TEST_CASE("creation: a watched path without a reader of values is not healthy, until it has one") {
  const testing::DomainLease lease;
  const Options options = without_memory(options_in(lease));
  Node node = Node::open("arm", frames(), options).value();
  auto client = Client::open(options).value();
  REQUIRE(testing::eventually([&] { return client.exists("base"); }));
  std::optional<PathWatch> watch;
  {
    const Failing failing(of_topic(kStateTopic));
    watch = ends([&] { return client.watch("map", "base"); }).value();
    CHECK(testing::eventually([&] {
      const auto health = watch->health();
      return !health && health.error().message.find(kStateTopic) != std::string::npos;
    }));
  }
  CHECK(testing::eventually([&] { return watch->health().has_value(); }));
  REQUIRE(node.update("base", testing::along_x(7)));
  CHECK(testing::eventually([&] {
    const auto X = watch->latest();
    return X && X->pose.translation().x() == 7;
  }));
}

TEST_CASE("creation: a watched partition without a reader of values says so, until it has one") {
  const testing::DomainLease lease;
  const Options options = without_memory(options_in(lease));
  const Node node = Node::open("arm", frames(), options).value();
  auto client = Client::open(options).value();
  std::mutex mutex;
  bool reachable = false;
  std::string why;
  const auto take = [&](const PartitionNews& news) {
    const auto* reach = std::get_if<ReachNews>(&news.what);
    if (reach == nullptr) return;
    const std::lock_guard<std::mutex> lock(mutex);
    reachable = reach->reachable;
    if (!reachable) why = reach->why;
  };
  const auto says = [&](bool wished) {
    return testing::eventually([&] {
      const std::lock_guard<std::mutex> lock(mutex);
      return reachable == wished && (wished || why.find(kStateTopic) != std::string::npos);
    });
  };
  std::optional<PartitionWatch> watch;
  {
    const Failing failing(of_topic(kStateTopic));
    watch = ends([&] { return client.watch_partition("arm", {0, take}); }).value();
    CHECK(says(false));
  }
  CHECK(says(true));
}

TEST_CASE("creation: an owner that cannot push values ends nevertheless") {
  const testing::DomainLease lease;
  const Options options = without_memory(options_in(lease));
  auto node = std::make_unique<Node>(Node::open("arm", frames(), options).value());
  auto client = Client::open(options).value();
  REQUIRE(testing::eventually([&] { return client.exists("base"); }));
  const Failing failing([](const std::string& what) {
    return of_topic(kStateTopic)(what) && what.find("the writer") == 0;
  });
  const auto watch = client.watch("map", "base").value();
  REQUIRE(node->update("base", testing::along_x(7)));
  // The renewals of the watch bring it.
  CHECK(testing::eventually([&] {
    const auto X = watch.latest();
    return X && X->pose.translation().x() == 7;
  }));
  ends([&] { node.reset(); });
}

}  // namespace tfdude
