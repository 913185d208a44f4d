// Watches beside all that the owner wrote, while messages are lost and late.

#include <chrono>
#include <deque>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "base/loop.hpp"
#include "partition/directory.hpp"
#include "runtime/watched_partition.hpp"
#include "runtime/watched_path.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::Random;

using Samples = std::map<std::pair<std::string, Time>, double>;  // x by frame and stamp

// Collects what a watch tells.
class Told {
 public:
  void add(const PartitionNews& news) {
    const std::lock_guard lock(mutex_);
    if (const auto* frames = std::get_if<FramesNews>(&news.what)) frames_ = frames->frames;
    const auto* values = std::get_if<ValuesNews>(&news.what);
    if (values == nullptr) return;
    for (const WatchedValue& value : values->values) {
      if (!value.stamp) continue;
      samples_[{frames_.at(value.frame).id, *value.stamp}] = value.X_PC.pose.translation().x();
    }
  }
  // The first of these samples that was not told, or otherwise.
  std::string lacks(const Samples& written) {
    const std::lock_guard lock(mutex_);
    for (const auto& [of, x] : written) {
      const auto told = samples_.find(of);
      const auto ms = nanoseconds(of.second) / 1'000'000;
      if (told == samples_.end()) return of.first + " at " + std::to_string(ms) + " ms";
      if (told->second != x) return "the newest value of " + of.first;
    }
    return {};
  }

 private:
  std::mutex mutex_;
  std::vector<WatchedFrame> frames_;
  Samples samples_;
};

// An owner of two edges that move, and a watch of them. What is between them loses pushes and
// delays answers.
class Lossy {
 public:
  Lossy(Random& random, Watched& watch) : random_(random), watch_(watch) {
    REQUIRE(forest_.add("base", "", {}));
    for (const char* id : {"arm", "lamp"}) {
      REQUIRE(forest_.add(id, "base", along_x(0)));
      REQUIRE(forest_.update(id, along_x(0), time_));
    }
    while (!is_settled()) round();
  }

  void step() {
    switch (random_.index(8)) {
      case 0:
        begin_round();
        break;
      case 1:
        end_round();
        break;
      case 2:  // another reader has come
        for (auto& [id, group] : groups_) {
          if (auto all = group.snapshot(forest_, {})) pushed_.push_back(*std::move(all));
        }
        break;
      case 3:
        if (random_.index(4) == 0) change_frames();
        break;
      default:
        write();
    }
    if (random_.index(2) == 0) push();
    while (!pushed_.empty() && random_.index(3) != 0) {
      if (random_.index(5) != 0) (void)watch_.take(pushed_.front(), now_);
      pushed_.pop_front();
    }
    now_ += Milliseconds(random_.index(20));
  }

  // All arrives from now on.
  void settle() {
    push();
    for (PushedValues& each : std::exchange(pushed_, {})) (void)watch_.take(each, now_);
    end_round();
    for (int i = 0; i < 100; ++i) round();
    REQUIRE(is_settled());
  }

  [[nodiscard]] const Samples& written() const { return written_; }
  [[nodiscard]] const Forest& forest() const { return forest_; }

 private:
  void write() {
    time_ += Milliseconds(1 + random_.index(5));
    const std::string id = random_.index(2) == 0 ? "arm" : "lamp";
    const double x = random_.uniform(0, 1);
    REQUIRE(forest_.update(id, along_x(x), time_));
    written_[{id, time_}] = x;
  }

  void change_frames() {
    if (forest_.exists("tool")) {
      REQUIRE(forest_.remove("tool"));
    } else {
      REQUIRE(forest_.add("tool", "arm", along_x(0)));
    }
  }

  void push() {
    for (auto& [id, group] : groups_) {
      PushedValues next = group.next_push(forest_);
      if (!next.entries.empty()) pushed_.push_back(std::move(next));
    }
  }

  [[nodiscard]] bool is_settled() const { return !groups_.empty() && !watch_.lacks(now_); }

  void begin_round() {
    if (asked_) return;
    REQUIRE(watch_.plan({forest_, directory_, 1}));
    const Watched::Plan plan = watch_.adopt(now_);
    if (!plan.is_new && !watch_.lacks(now_) && random_.index(4) != 0) return;
    from_ = watch_.lacks_from();
    asked_.emplace();
    for (const Watched::Group& each : plan.groups) {
      const auto& request = std::get<WatchRequest>(each.part.request.body);
      const auto [group, is_new] = groups_.try_emplace(each.id, each.id, request);
      auto all = group->second.snapshot(forest_, from_, true);
      if (!all) continue;
      if (is_new) group->second.begin(*all);
      asked_->push_back(*std::move(all));
    }
  }

  void end_round() {
    if (!asked_) return;
    for (const PushedValues& each : *asked_) (void)watch_.take(each, now_);
    if (from_ && !asked_->empty()) watch_.on_told_from(*from_, now_);
    asked_.reset();
    const auto used = watch_.groups(now_);
    for (auto group = groups_.begin(); group != groups_.end();) {
      group = used.count(group->first) > 0 ? std::next(group) : groups_.erase(group);
    }
  }

  void round() {
    begin_round();
    end_round();
    now_ += 50ms;
    push();
    for (PushedValues& each : std::exchange(pushed_, {})) (void)watch_.take(each, now_);
  }

  Random& random_;
  Watched& watch_;
  Forest forest_;
  Directory directory_{forest_, "arm"};
  Time time_{10s};
  Samples written_;
  Watched::Clock::time_point now_{1h};
  std::map<std::uint64_t, WatchedGroup> groups_;
  std::deque<PushedValues> pushed_;
  std::optional<std::vector<PushedValues>> asked_;
  std::optional<Time> from_;
};

void run(Lossy& lossy) {
  for (int i = 0; i < 60; ++i) lossy.step();
  lossy.settle();
}

}  // namespace

TEST_CASE("watched partition: each sample is told, whatever was lost before") {
  Loop loop{"test"};
  Callbacks callbacks{loop};
  for (int seed = 0; seed < 500; ++seed) {
    Random random(static_cast<std::uint64_t>(seed));
    INFO("seed " << random.seed());
    Told told;
    const auto line = callbacks.line();
    WatchedPartition watch(
        "arm", 0, [&told](const PartitionNews& news) { told.add(news); }, line);
    Lossy lossy(random, watch);
    run(lossy);
    std::promise<void> all;
    line->post([&all] { all.set_value(); });
    all.get_future().wait();
    CHECK(told.lacks(lossy.written()) == "");
  }
}

TEST_CASE("watched path: it has each sample, whatever was lost before") {
  for (int seed = 0; seed < 500; ++seed) {
    Random random(static_cast<std::uint64_t>(seed));
    INFO("seed " << random.seed());
    WatchedPath watch({"arm", "lamp"}, {});
    Lossy lossy(random, watch);
    run(lossy);
    for (const auto& [of, x] : lossy.written()) {
      Query query;
      query.at = of.second;
      INFO(of.first << " at " << nanoseconds(of.second) / 1'000'000 << " ms");
      CHECK(watch.lookup("base", of.first, query).value().pose.translation().x() == x);
    }
  }
}

}  // namespace tfdude
