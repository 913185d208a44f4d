// All edges of a partition, pushed by their owner, over each transport: what is reported, in which
// order, and what is not.

#include <algorithm>
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/networks.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::eventually;
using testing::Join;
using testing::joined_by;

Time ms(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

// What a listener has been told, in a form to compare.
class Log {
 public:
  void add(const PartitionNews& news) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (const auto* reach = std::get_if<ReachNews>(&news.what)) {
      reached_.push_back(reach->reachable);
      return;
    }
    if (const auto* frames = std::get_if<FramesNews>(&news.what)) {
      frames_ = frames->frames;
      incarnation_ = frames->incarnation;
      ++frame_lists_;
      return;
    }
    const auto& values = std::get<ValuesNews>(news.what);
    ++messages_;
    for (const WatchedValue& value : values.values) {
      const std::string& id = frames_.at(value.frame).id;
      const double x = value.X_PC.pose.translation().x();
      if (value.begins) ++begins_[id];
      ++values_[id];
      last_[id] = x;
      if (value.stamp) together_[nanoseconds(*value.stamp)].insert({id, messages_});
    }
  }

  template <class Ask>
  auto operator()(Ask ask) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return ask(*this);
  }

  std::vector<WatchedFrame> frames_;
  std::uint64_t incarnation_ = 0;
  int frame_lists_ = 0;
  std::vector<bool> reached_;
  int messages_ = 0;
  std::map<std::string, double> last_;
  std::map<std::string, int> values_;
  std::map<std::string, int> begins_;
  std::map<std::int64_t, std::set<std::pair<std::string, int>>> together_;  // stamp: id, message

 private:
  mutable std::mutex mutex_;
};

bool is_last(const Log& log, const std::string& id, double x) {
  return log([&](const Log& all) {
    const auto found = all.last_.find(id);
    return found != all.last_.end() && found->second == x;
  });
}

std::vector<std::string> ids_in(const Log& log) {
  return log([](const Log& all) {
    std::vector<std::string> ids;
    for (const WatchedFrame& frame : all.frames_) ids.push_back(frame.id + "<" + frame.parent);
    return ids;
  });
}

PartitionWatchOptions to(Log& log, double rate = 0) {
  return {rate, [&log](const PartitionNews& news) { log.add(news); }};
}

std::vector<FrameSpec> arm_frames() {
  return {{"base", "", {}}, {"arm", "base", along_x(1)}, {"hand", "arm", along_x(2)}};
}

}  // namespace

TEST_CASE("partition watch: all samples come, those of one commit together") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  auto node = Node::open(join("arm"), "arm", arm_frames());
  auto client = Client::open(join(""));
  REQUIRE(node);
  REQUIRE(client);
  Log log;
  const auto watch = client->watch_partition("arm", to(log));
  REQUIRE(watch);
  REQUIRE(eventually([&] { return is_last(log, "hand", 2); }));
  CHECK(is_last(log, "arm", 1));
  CHECK(ids_in(log) == std::vector<std::string>{"arm<base", "base<", "hand<arm"});
  // From the first value on, until DDS has matched the reader, only the newest one comes.
  REQUIRE(node->update({{"arm", along_x(0)}, {"hand", along_x(0)}}, ms(1)));
  REQUIRE(eventually([&] { return is_last(log, "hand", 0); }));
  std::this_thread::sleep_for(600ms);
  constexpr int kSamples = 500;
  for (int i = 2; i <= kSamples; ++i) {
    REQUIRE(node->update({{"arm", along_x(i)}, {"hand", along_x(-i)}}, ms(i)));
    if (i % 10 == 0) std::this_thread::sleep_for(1ms);
  }
  REQUIRE(eventually([&] { return is_last(log, "hand", -kSamples); }));
  log([&](const Log& all) {
    for (int i = 2; i <= kSamples; ++i) {
      INFO(i);
      const auto& both = all.together_.at(nanoseconds(ms(i)));
      REQUIRE(both.size() == 2);  // each once
      CHECK(both.begin()->second == both.rbegin()->second);
    }
    CHECK(all.reached_ == std::vector<bool>{true});
    CHECK(all.frame_lists_ == 1);
    return 0;
  });
}

TEST_CASE("partition watch: changes of the structure are reported, and no value is repeated") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  auto node = Node::open(join("arm"), "arm", arm_frames());
  auto client = Client::open(join(""));
  Log log;
  const auto watch = client->watch_partition("arm", to(log));
  REQUIRE(watch);
  REQUIRE(eventually([&] { return is_last(log, "hand", 2); }));
  REQUIRE(node->add("tool", "hand", along_x(7)));
  REQUIRE(eventually([&] { return is_last(log, "tool", 7); }));
  REQUIRE(node->move("tool", "base", along_x(8)));
  REQUIRE(eventually([&] { return is_last(log, "tool", 8); }));
  CHECK(ids_in(log).back() == "tool<base");
  REQUIRE(node->move("tool", "base", along_x(8.5)));
  REQUIRE(eventually([&] { return is_last(log, "tool", 8.5); }));
  REQUIRE(node->update("hand", along_x(3)));
  REQUIRE(eventually([&] { return is_last(log, "hand", 3); }));
  REQUIRE(node->remove("tool"));
  REQUIRE(eventually([&] { return ids_in(log).size() == 3; }));
  REQUIRE(node->update("hand", along_x(4)));
  REQUIRE(eventually([&] { return is_last(log, "hand", 4); }));
  // As before, within the time that the group of before is kept.
  REQUIRE(node->add("tool", "base", along_x(9)));
  REQUIRE(eventually([&] { return is_last(log, "tool", 9); }));
  log([](const Log& all) {
    CHECK(all.values_.at("arm") == 1);
    CHECK(all.values_.at("hand") == 3);
    CHECK(all.begins_.at("hand") == 1);
    CHECK(all.begins_.at("tool") == 4);  // the edge under another parent is another one
    return 0;
  });
}

TEST_CASE("partition watch: an owner that stops and returns is reported, with all its values") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  std::optional<Node> node(Node::open(join("arm"), "arm", arm_frames()).value());
  auto client = Client::open(join(""));
  Log log;
  const auto watch = client->watch_partition("arm", to(log));
  REQUIRE(watch);
  REQUIRE(eventually([&] { return is_last(log, "hand", 2); }));
  const auto before = log([](const Log& all) { return all.incarnation_; });
  node.reset();
  REQUIRE(eventually([&] {
    return log([](const Log& all) { return all.reached_ == std::vector<bool>{true, false}; });
  }));
  CHECK(is_last(log, "hand", 2));
  node.emplace(Node::open(join("arm"), "arm", arm_frames()).value());
  REQUIRE(eventually([&] {
    return log([](const Log& all) {
      return all.reached_ == std::vector<bool>{true, false, true} && all.begins_.at("hand") == 2;
    });
  }));
  CHECK(log([](const Log& all) { return all.incarnation_; }) > before);
}

TEST_CASE("partition watch: with a rate, only the newest values come") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  auto node = Node::open(join("arm"), "arm", arm_frames());
  auto client = Client::open(join(""));
  Log log;
  const auto watch = client->watch_partition("arm", to(log, 10));
  REQUIRE(watch);
  REQUIRE(eventually([&] { return is_last(log, "hand", 2); }));
  const int before = log([](const Log& all) { return all.messages_; });
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 1; i <= 500; ++i) {
    REQUIRE(node->update({{"arm", along_x(i)}, {"hand", along_x(-i)}}, ms(i)));
    std::this_thread::sleep_for(1ms);
  }
  REQUIRE(eventually([&] { return is_last(log, "hand", -500); }));
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
  // And one more for each of: the first, the last, a reply to a renewal.
  const int news = log([](const Log& all) { return all.messages_; }) - before;
  CHECK(news <= static_cast<int>(taken.count() * 10) + 4);
  CHECK(news >= 3);
  const auto wrong = client->watch_partition("arm", to(log, -1));
  CHECK(wrong.error().code == Errc::kInvalidInput);
  CHECK(client->watch_partition("nobody", to(log)).error().code == Errc::kUnknownPartition);
}

TEST_CASE("partition watch: a path and a partition that need the same edges share their reader") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  auto node = Node::open(join("arm"), "arm", {{"base", "", {}}, {"arm", "base", along_x(1)}});
  auto client = Client::open(join(""));
  Log log;
  auto path = client->watch("base", "arm");
  REQUIRE(path);
  {
    const auto watch = client->watch_partition("arm", to(log));
    REQUIRE(watch);
    REQUIRE(eventually([&] { return is_last(log, "arm", 1); }));
  }
  const int before = log([](const Log& all) { return all.messages_; });
  REQUIRE(node->update("arm", along_x(5)));
  REQUIRE(eventually([&] {
    const auto X = path->latest();
    return X && X->pose.translation().x() == 5;
  }));
  CHECK(log([](const Log& all) { return all.messages_; }) == before);
}

TEST_CASE("partition watch: a listener that takes long delays nobody, and may end its watch") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  auto node = Node::open(join("arm"), "arm", arm_frames());
  auto client = Client::open(join(""));
  std::mutex mutex;
  std::optional<PartitionWatch> watch;
  std::atomic<int> calls{0};
  std::unique_lock<std::mutex> blocked(mutex);
  auto opened = client->watch_partition("arm", {0, [&](const PartitionNews&) {
                                                  const std::lock_guard<std::mutex> lock(mutex);
                                                  if (++calls == 2) watch.reset();
                                                }});
  REQUIRE(opened);
  watch.emplace(*std::move(opened));
  for (int i = 1; i <= 100; ++i) REQUIRE(node->update("hand", along_x(i), ms(i)));
  CHECK(client->lookup("arm", "hand"));
  blocked.unlock();
  REQUIRE(eventually([&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return !watch;
  }));
  CHECK(calls == 2);
  REQUIRE(node->update("hand", along_x(5), ms(1000)));
  std::this_thread::sleep_for(50ms);
  CHECK(calls == 2);
}

TEST_CASE("partition watch: more correlated edges than one answer can have") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  constexpr int kEdges = 300;
  std::vector<FrameSpec> frames{{"base", "", {}}};
  CommonError supply{"supply", false, Loading::Zero(6, 1)};
  supply.loading(0, 0) = 0.01;
  for (int i = 0; i < kEdges; ++i) {
    FrameSpec frame{"f" + std::to_string(i), "base", along_x(i)};
    frame.correlation.common_errors.push_back(supply);
    frames.push_back(frame);
  }
  auto node = Node::open(join("arm"), "arm", frames);
  auto client = Client::open(join(""));
  Log log;
  const auto watch = client->watch_partition("arm", to(log));
  REQUIRE(watch);
  CHECK(eventually([&] { return log([](const Log& all) { return all.last_.size(); }) == kEdges; }));
}

}  // namespace tfdude
