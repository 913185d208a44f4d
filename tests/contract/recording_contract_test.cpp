// What a recording answers, beside what the live system answered: over each transport.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <tuple>
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

using testing::Approx;
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

  // Whether the sample of this instant has come. A late one may come after newer ones, and so does
  // one that was lost and is sent again.
  bool has(const std::string& frame, Time stamp) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return told_.count({frame, stamp}) > 0;
  }

  // Whether a sample of each of these frames has come.
  bool hears(const std::vector<std::string>& moving) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::all_of(moving.begin(), moving.end(), [&](const std::string& frame) {
      const auto first = told_.lower_bound({frame, Time::min()});
      return first != told_.end() && first->first == frame;
    });
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
    Matrix6d sigma = told.X_PC.covariance.of_specified().matrix();
    for (const CommonError& one : told.correlation.common_errors) {
      sigma += one.loading * one.loading.transpose();
    }
    const Matrix6d of_owner = owned.covariance.of_specified().matrix();
    return told.correlation.common_errors.empty() == owned.basis.sources.empty() &&
           (sigma - of_owner).cwiseAbs().maxCoeff() < 1e-12 &&
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

// Of the samples of a change.
std::vector<Time> stamps_of(int number) {
  std::vector<Time> stamps;
  for (int i = 0; i < 4; ++i) stamps.push_back(step(number) + std::chrono::milliseconds(250 * i));
  return stamps;
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
    for (const Time each : stamps_of(number)) sample(each);
    return late;
  }

  void sample(Time at) {
    (void)base_->update("lift", random_value(random_), at);
    (void)arm_->update({{"elbow", random_value(random_)}}, at);
    // More than half a turn apart, too.
    JointValue wrist{"wrist", random_.uniform(-5, 5), 1e-4};
    if (random_.index(5) == 0) wrist.variance.reset();
    (void)arm_->update_joints({wrist}, at);
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
    Time before = step(-8);
    REQUIRE(eventually([&] {
      world.sample(before += std::chrono::microseconds(100));
      return recorded.hears({"lift", "elbow", "wrist"});
    }));
    for (const char* moving : {"lift", "elbow", "wrist"}) {
      REQUIRE(eventually([&] { return recorded.has(moving, before); }));
    }
    for (int number = 1; number <= kSteps; ++number) {
      recorded.set_time(step(number));
      const auto late = world.change(number);
      REQUIRE(eventually([&] { return recorded.has_all(world.arm(), *client); }));
      if (late) REQUIRE(eventually([&] { return recorded.has("elbow", *late); }));
      for (const Time stamp : stamps_of(number)) {
        for (const char* moving : {"lift", "elbow", "wrist"}) {
          REQUIRE(eventually([&] { return recorded.has(moving, stamp); }));
        }
      }
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

namespace {

Covariance of_deviation(double sigma) {
  return *Covariance::from_stddev({sigma, sigma, sigma, sigma, sigma, sigma});
}

// What a robot sees of two objects, recorded: one edge is localized anew in each sample, one shares
// a named source besides, and one is odometry.
class Seeing {
 public:
  explicit Seeing(const Join& join) {
    const Transform at_start{Pose(), of_deviation(0.1)};
    FrameSpec odometry{"odometry", "world", Transform::exact(Pose())};
    odometry.timing = EdgeTiming();
    odometry.timing->drifts = true;
    odometry.timing->process_noise = of_deviation(0.05);
    std::vector<FrameSpec> frames{{"world", "", {}}, odometry};
    for (const char* id : {"plain", "sharing", "near", "far"}) {
      frames.push_back({id, "world", at_start});
    }
    node_.emplace(Node::open(join("base"), "base", frames).value());
    Loading supply = Loading::Zero(6, 1);
    supply(0) = 0.05;
    REQUIRE(node_->correlate("sharing", {false, {{"supply", false, supply}}, {}}));
  }

  void drive(int number) { is_at(0.2 * number, step(number)); }

  void is_at(double x, Time at) {
    const Transform X{Pose(), of_deviation(0.1)};
    for (const char* id : {"plain", "sharing"}) REQUIRE(node_->update(id, X, at));
    const Pose G = Pose::trusted(Eigen::Quaterniond::Identity(), {x, 0, 0});
    REQUIRE(node_->update("odometry", Transform::exact(G), at));
  }

  void see(int number) {
    for (const auto& [from, id] :
         {std::pair("plain", "near"), std::pair("sharing", "far"), std::pair("odometry", "near")}) {
      const auto X = node_->lookup(from, id, when(number)).value();
      REQUIRE(node_->observe(from, id, {X.pose, of_deviation(0.01)}, step(number)));
    }
  }

  static Query when(double number) {
    Query query;
    query.at = step(0) + std::chrono::milliseconds(std::lround(1000 * number));
    query.extrapolate = std::chrono::seconds(1);
    return query;
  }

  Node& node() { return *node_; }

 private:
  std::optional<Node> node_;
};

bool is_same(const Result<StampedTransform>& found, const Result<StampedTransform>& live) {
  if (!found || !live) return found.has_value() == live.has_value();
  return difference(*found, *live) <= 1e-9 && found->basis.sources == live->basis.sources;
}

// What a watch has told, and when.
class News {
 public:
  explicit News(Client& client)
      : watch_(client.watch_partition("base", {0, [this](const PartitionNews& news) { add(news); }})
                   .value()) {}

  void set_time(Time now) {
    const std::lock_guard<std::mutex> lock(mutex_);
    now_ = now;
  }
  // How many samples, and those that an observation has corrected once more.
  std::size_t count() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return told_.size();
  }
  // Whether the samples of this instant have come, of three edges.
  bool tells(Time stamp) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return 3 <= std::count_if(told_.begin(), told_.end(),
                              [&](const auto& one) { return std::get<Time>(one) == stamp; });
  }
  Recording recorded(const std::string& file, Time end) {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::filesystem::remove(file);
    auto writer = RecordingWriter::create(file, step(0)).value();
    for (const auto& [news, at] : news_) REQUIRE(writer.add(news, at));
    REQUIRE(writer.finish(end));
    auto recording = Recording::open(file).value();
    recording.seek(end);
    return recording;
  }

 private:
  void add(const PartitionNews& news) {
    const std::lock_guard<std::mutex> lock(mutex_);
    news_.emplace_back(news, now_);
    const auto* values = std::get_if<ValuesNews>(&news.what);
    if (values == nullptr) return;
    for (const WatchedValue& value : values->values) {
      if (!value.stamp) continue;
      told_.emplace(value.frame, false, *value.stamp);
      if (value.of_sample()) told_.emplace(value.frame, true, *value.stamp);
    }
  }

  std::mutex mutex_;
  Time now_ = step(0);
  std::vector<std::pair<PartitionNews, Time>> news_;
  std::set<std::tuple<std::uint32_t, bool, Time>> told_;
  PartitionWatch watch_;
};

}  // namespace

TEST_CASE("recording: what was observed is as certain as it was") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Seeing robot(join);
  auto client = Client::open(join("")).value();
  const std::string file = a_file();
  const std::vector<std::string> names{"world", "odometry", "plain", "sharing", "near", "far"};
  constexpr int kSteps = 8;
  News news(client);
  // Before DDS has matched the readers, first samples may be left out.
  Time before = step(-1);
  REQUIRE(eventually([&] {
    robot.is_at(0, before += std::chrono::microseconds(50));
    return news.count() > 0;
  }));
  REQUIRE(eventually([&] { return news.tells(before); }));
  std::size_t count = news.count();
  for (int number = 1; number <= kSteps; ++number) {
    news.set_time(step(number));
    robot.drive(number);
    count += 3;
    if (number % 3 == 0) {
      robot.see(number);
      count += 3;
    } else if (number > 3) {
      count += 1;  // of odometry
    }
    REQUIRE(eventually([&] { return news.count() >= count; }));
  }
  std::vector<Asked> asked;
  for (const double at : {2.0, 3.0, 3.4, 4.0, 6.0, 6.7, 7.0, 8.0, 8.5}) {
    for (const auto& a : names) {
      for (const auto& b : names) {
        const Query query = Seeing::when(at);
        asked.push_back({0, a, b, query, robot.node().lookup(a, b, query)});
      }
    }
  }
  // Later sightings correct earlier samples, too: who has them is not told of that.
  const auto is_told = [](const Asked& one) { return *one.query.at >= step(6); };
  // What was lost comes once more.
  const auto has_all = [&] {
    auto recording = news.recorded(file, step(kSteps + 1));
    return std::all_of(asked.begin(), asked.end(), [&](const Asked& one) {
      return !is_told(one) || is_same(recording.lookup(one.a, one.b, one.query), one.live);
    });
  };
  CHECK(eventually(has_all));
  auto recording = news.recorded(file, step(kSteps + 1));
  for (const Asked& one : asked) {
    INFO(one.a << " to " << one.b << " at " << (*one.query.at - step(0)).count());
    const auto found = recording.lookup(one.a, one.b, one.query);
    REQUIRE(found.has_value() == one.live.has_value());
    if (!found) continue;
    if (!is_told(one)) {
      const auto trace = [](const StampedTransform& X) {
        return X.covariance.of_specified().matrix().trace();
      };
      CHECK(trace(*found) >= trace(*one.live) * (1 - 1e-9));
      continue;
    }
    CHECK(difference(*found, *one.live) <= 1e-9);
    CHECK(found->basis.sources == one.live->basis.sources);
  }
  // The last time it was seen with an error of 0.01: more than either had before.
  const auto seen = recording.lookup("sharing", "far", Seeing::when(6)).value();
  CHECK(std::sqrt(seen.covariance.of_specified().upper()[upper_index(1, 1)]) ==
        Approx(0.01 / std::sqrt(1 + 0.01 * 0.01 / 0.02)).epsilon(1e-3));
  std::filesystem::remove(file);
}

TEST_CASE("watch: an edge that drifts is as certain as a lookup says, at any instant") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Seeing robot(join);
  auto client = Client::open(join("")).value();
  const auto watch = client.watch("world", "odometry");
  REQUIRE(watch);
  for (int number = 1; number <= 4; ++number) {
    robot.drive(number);
    if (number == 2) robot.see(number);
    const auto has = [&] {
      const auto X = watch->latest();
      return X && X->stamp == step(number);
    };
    REQUIRE(eventually(has));
  }
  for (const double at : {2.0, 2.5, 3.0, 3.3, 4.0, 4.5}) {
    INFO(at);
    const Query query = Seeing::when(at);
    const auto watched = watch->lookup(query);
    REQUIRE(watched);
    CHECK(difference(*watched, robot.node().lookup("world", "odometry", query).value()) <= 1e-9);
  }
}

}  // namespace tfdude
