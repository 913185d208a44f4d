// What a recording answers, beside what the live system answered: over each transport.

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <unistd.h>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/recording/recording.hpp"
#include "tfdude/recording/recording_writer.hpp"

#include "support/catch.hpp"
#include "support/joint_frames.hpp"
#include "support/networks.hpp"
#include "support/process.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::eventually;
using testing::Join;
using testing::joined_by;
using testing::moved_by;
using testing::Random;
using testing::revolute_named;

// The clock of the test: one step is a second.
Time step(int number) { return Time(std::chrono::seconds(1000 + number)); }

std::string a_file() {
  static int count = 0;
  const auto path =
      std::filesystem::temp_directory_path() /
      ("tfdude-recording-" + std::to_string(getpid()) + "-" + std::to_string(++count) + ".mcap");
  std::filesystem::remove(path);
  return path;
}

std::vector<std::string> lines(const std::vector<Frame>& frames) {
  std::vector<std::string> all;
  for (const Frame& frame : frames) {
    all.push_back(frame.id + "<" + frame.parent + " of " + frame.partition +
                  (frame.attached ? "" : ", waits"));
  }
  return all;
}

// Records two partitions, and knows how far.
class Recorded {
 public:
  Recorded(Client& client, const std::string& file)
      : writer_(*RecordingWriter::create(file, step(0))) {
    for (const char* name : {"base", "arm"}) {
      watches_.push_back(
          client.watch_partition(name, {0, [this](const PartitionNews& news) { add(news); }})
              .value());
    }
  }

  void set_time(Time now) {
    const std::lock_guard<std::mutex> lock(mutex_);
    now_ = now;
  }

  // Whether the newest values of all edges have come; structure may come before or after values.
  bool has_all(Client& owner, Client& client) {
    const auto all = owner.frames();
    if (lines(all.value()) != lines(client.frames().value())) return false;
    for (const Frame& frame : *all) {
      const auto X = owner.lookup(frame.parent.empty() ? frame.id : frame.parent, frame.id, {});
      const std::lock_guard<std::mutex> lock(mutex_);
      const auto known = known_.find({frame.id, frame.parent});
      if (known == known_.end()) return false;
      if (!frame.parent.empty() && (!X || !is_same(known->second, *X))) return false;
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    return all->size() == known_.size();
  }

  // Whether the sample of this instant has come. A late one may come after newer ones.
  bool has(const std::string& frame, Time stamp) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return told_.count({frame, stamp}) > 0;
  }

  void finish() {
    watches_.clear();
    REQUIRE(writer_.finish(now_));
  }

 private:
  void add(const PartitionNews& news) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!writer_.add(news, now_)) std::abort();
    if (const auto* frames = std::get_if<FramesNews>(&news.what)) {
      for (const WatchedFrame& frame : frames_[news.partition]) {
        const auto& now = frames->frames;
        if (std::find(now.begin(), now.end(), frame) == now.end()) {
          known_.erase({frame.id, frame.parent});
        }
      }
      frames_[news.partition] = frames->frames;
      for (const WatchedFrame& frame : frames->frames) {
        known_.emplace(std::pair(frame.id, frame.parent), WatchedValue());
      }
    }
    const auto* values = std::get_if<ValuesNews>(&news.what);
    if (values == nullptr) return;
    for (const WatchedValue& value : values->values) {
      const WatchedFrame& frame = frames_[news.partition].at(value.frame);
      if (value.stamp) told_.emplace(frame.id, *value.stamp);
      WatchedValue& last = known_[{frame.id, frame.parent}];
      if (value.begins || value.stamp >= last.stamp) last = value;
    }
  }

  // The covariance of a lookup also contains common errors.
  static bool is_same(const WatchedValue& told, const StampedTransform& owned) {
    return told.correlation.common_errors.empty() == owned.basis.sources.empty() &&
           (told.X_PC.pose.matrix() - owned.pose.matrix()).cwiseAbs().maxCoeff() < 1e-12;
  }

  std::mutex mutex_;
  RecordingWriter writer_;
  Time now_ = step(0);
  std::map<std::string, std::vector<WatchedFrame>> frames_;
  std::map<std::pair<std::string, std::string>, WatchedValue> known_;  // by frame and parent
  std::set<std::pair<std::string, Time>> told_;
  std::vector<PartitionWatch> watches_;
};

struct Asked {
  int at;
  std::string a;
  std::string b;
  Query query;
  Result<StampedTransform> live;
};

double difference(const StampedTransform& a, const StampedTransform& b) {
  double most = (a.pose.matrix() - b.pose.matrix()).cwiseAbs().maxCoeff();
  const auto& left = a.covariance.of_specified().upper();
  const auto& right = b.covariance.of_specified().upper();
  for (std::size_t i = 0; i < left.size(); ++i) {
    most = std::max(most, std::abs(left[i] - right[i]));
  }
  return most;
}

Transform random_value(Random& random) {
  Transform X = random.transform();
  if (random.index(5) == 0) X.covariance = StatedCovariance::unspecified();
  return X;
}

// Two partitions whose frames move, come and go, with all kinds of values.
class World {
 public:
  World(const Join& join, Random& random) : random_(random) {
    EdgeTiming noisy;
    noisy.process_noise = *Covariance::from_stddev({0.01, 0.01, 0.01, 0.01, 0.01, 0.01});
    base_.emplace(Node::open(join("base"), "base",
                             {{"world", "", {}},
                              {"base", "world", random_.transform()},
                              {"lift", "base", random_.transform(), noisy}})
                      .value());
    arm_.emplace(Node::open(join("arm"), "arm",
                            {{"shoulder", "lift", random_.transform()},
                             {"elbow", "shoulder", random_.transform(), noisy},
                             {"hand", "elbow", random_.transform()},
                             moved_by("wrist", "hand", revolute_named("wrist"))})
                     .value());
  }

  // @return the stamp of a late sample of the elbow, if there is one
  std::optional<Time> change(int number) {
    const Time stamp = step(number);
    std::optional<Time> late;
    switch (random_.index(8)) {
      case 0:
        (void)arm_->update("hand", random_value(random_));
        break;
      case 1:
        (void)base_->update("base", random_value(random_));
        break;
      case 2: {
        CommonError supply{"supply", false, Loading::Random(6, 1) * 0.01};
        (void)arm_->correlate("shoulder", {false, {supply}, {}});
        (void)base_->correlate("base", {false, {supply}, {}});
        break;
      }
      case 3:
        (void)arm_->add("tool", "hand", random_value(random_));
        break;
      case 4:
        (void)arm_->move("tool", random_.index(2) == 0 ? "elbow" : "world", random_value(random_));
        break;
      case 5:
        (void)arm_->remove("tool");
        break;
      case 6:  // a late sample
        late = stamp - std::chrono::milliseconds(2500);
        if (!arm_->update("elbow", random_value(random_), *late)) late.reset();
        break;
      default:
        break;
    }
    for (int i = 0; i < 4; ++i) {
      const Time at = stamp + std::chrono::milliseconds(250 * i);
      (void)base_->update("lift", random_value(random_), at);
      (void)arm_->update({{"elbow", random_value(random_)}}, at);
      // More than half a turn apart, too.
      JointValue wrist{"wrist", random_.uniform(-5, 5), 1e-4};
      if (random_.index(5) == 0) wrist.variance.reset();
      (void)arm_->update_joints({wrist}, at);
    }
    return late;
  }

  Client& arm() { return *arm_; }

 private:
  Random& random_;
  std::optional<Node> base_;
  std::optional<Node> arm_;
};

}  // namespace

TEST_CASE("recording: it answers as the live system did, with covariance, at any instant") {
  Random random(7);
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  World world(join, random);
  auto client = Client::open(join(""));
  REQUIRE(client);
  const std::string file = a_file();
  std::vector<Asked> asked;
  std::map<int, std::vector<std::string>> frames;
  constexpr int kSteps = 60;
  {
    Recorded recorded(*client, file);
    REQUIRE(eventually([&] { return recorded.has_all(world.arm(), *client); }));
    // Before DDS has matched the readers, first samples may be left out.
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    for (int number = 1; number <= kSteps; ++number) {
      recorded.set_time(step(number));
      const auto late = world.change(number);
      REQUIRE(eventually([&] { return recorded.has_all(world.arm(), *client); }));
      if (late) REQUIRE(eventually([&] { return recorded.has("elbow", *late); }));
      frames[number] = lines(client->frames().value());
      const std::vector<std::string> names{"world", "lift", "shoulder", "hand", "wrist", "tool"};
      for (int i = 0; i < 8; ++i) {
        const auto& a = names[random.index(names.size())];
        const auto& b = names[random.index(names.size())];
        Query query;
        query.at = step(number) +
                   std::chrono::milliseconds(random.index(4) * 250 - 1300 + random.index(3) * 70);
        if (random.index(4) == 0) query.order = Order::kFourth;
        asked.push_back({number, a, b, query, client->lookup(a, b, query)});
      }
    }
    recorded.finish();
  }
  auto recording = Recording::open(file);
  REQUIRE(recording);
  CHECK(recording->summary().problems.empty());
  std::size_t answers = 0;
  double greatest = 0;
  // Forwards, then in any order.
  for (int round = 0; round < 2; ++round) {
    for (std::size_t i = 0; i < asked.size(); ++i) {
      const Asked& one = round == 0 ? asked[i] : asked[random.index(asked.size())];
      INFO(one.at << ": " << one.a << " to " << one.b);
      recording->seek(step(one.at));
      CHECK(lines(recording->frames()) == frames[one.at]);
      const auto found = recording->lookup(one.a, one.b, one.query);
      if (!one.live) {
        INFO(one.live.error().message);
        // Live histories are shorter.
        if (one.live.error().code == Errc::kTooOld) continue;
        REQUIRE_FALSE(found);
        CHECK(found.error().code == one.live.error().code);
        continue;
      }
      if (!found) FAIL(found.error().message);
      ++answers;
      const double off = difference(*found, *one.live);
      greatest = std::max(greatest, off);
      CHECK(off <= 1e-12);
      CHECK(found->stamp == one.live->stamp);
      CHECK(found->covariance.complete() == one.live->covariance.complete());
      CHECK(found->basis.unspecified == one.live->basis.unspecified);
      CHECK(found->basis.sources == one.live->basis.sources);
      CHECK(found->basis.bound == one.live->basis.bound);
    }
  }
  CHECK(greatest <= 1e-12);
  CHECK(answers > asked.size());
  std::filesystem::remove(file);
}

}  // namespace tfdude
