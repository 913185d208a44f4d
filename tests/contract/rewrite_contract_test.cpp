// The past of an edge is rewritten by another process, over each transport: what its owner, who
// watches, and a recording have then.

#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
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
#include "support/forest_support.hpp"
#include "support/networks.hpp"
#include "support/pose_diff.hpp"
#include "support/process.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::ContainsSubstring;
using testing::eventually;
using testing::Join;
using testing::joined_by;
using testing::outcome;
using testing::Random;

constexpr std::int64_t kMs = 1'000'000;

Time ms(std::int64_t milliseconds) { return time_of(milliseconds * kMs); }

Query query(std::int64_t milliseconds) {
  Query query;
  query.at = ms(milliseconds);
  return query;
}

double x_of(const Result<StampedTransform>& X) {
  return X ? X->pose.translation().x() : std::nan("");
}

// An owner whose odometry says how many milliseconds it is, every 10 ms until kEnd.
constexpr std::int64_t kEnd = 5000;
struct Slam {
  explicit Slam(const Join& join, Milliseconds timeout = Milliseconds(2000)) {
    EdgeTiming timing;
    timing.span = std::chrono::hours(1);
    timing.count = 100'000;
    timing.max_ahead = std::chrono::nanoseconds::max();
    FrameSpec odom{"odom", "map", along_x(0)};
    odom.timing = timing;
    node.emplace(
        Node::open(join("slam"), "slam", {{"map", "", {}}, odom, {"fixed", "map", {}}}).value());
    for (std::int64_t t = 0; t <= kEnd; t += 10) {
      REQUIRE(node->update("odom", along_x(static_cast<double>(t)), ms(t)));
    }
    Options options;
    options.timeout = timeout;
    client.emplace(Client::open(join(""), options).value());
  }

  std::optional<Node> node;
  std::optional<Client> client;
};

// Samples that say x, every 7 ms.
std::vector<EdgeSample> saying(double x, std::int64_t from, std::int64_t to) {
  std::vector<EdgeSample> samples{{ms(from), along_x(x)}};
  for (std::int64_t t = from + 7; t < to; t += 7) samples.push_back({ms(t), along_x(x)});
  samples.push_back({ms(to), along_x(x)});
  return samples;
}

}  // namespace

TEST_CASE("rewrite: values, covariances and stamps arrive as they are given") {
  Slam slam(joined_by(GENERATE(from_range(testing::networks()))));
  Random random(81);
  INFO("seed " << random.seed());
  std::vector<EdgeSample> samples;  // of several requests, of which the last is not full
  for (std::int64_t i = 0; i < 3001; ++i) {
    Transform X = random.transform();
    if (i % 3 > 0 && i > 0) X.covariance = samples.back().X_PC.covariance;
    if (i % 100 == 0) X.covariance = StatedCovariance::unspecified();
    samples.push_back({time_of(1000 * kMs + i * 1'000'003), X});
  }
  REQUIRE(slam.client->rewrite("odom", {ms(1000), ms(4900)}, samples));
  for (std::size_t i = 0; i < samples.size(); i += 29) {
    Query then;
    then.at = samples[i].stamp;
    for (Client* client : {&*slam.client, static_cast<Client*>(&*slam.node)}) {
      const auto X = client->lookup("map", "odom", then);
      REQUIRE(X);
      CHECK(X->covariance.complete() == samples[i].X_PC.covariance.complete());
      CHECK(testing::transform_diff(*X, samples[i].X_PC, 1e-9) == "");
    }
  }
  CHECK(x_of(slam.client->lookup("map", "odom", query(990))) == 990);
  CHECK(x_of(slam.client->lookup("map", "odom", query(4910))) == 4910);
  CHECK(slam.client->history("odom").value().at(0).samples == 501 - 391 + 3001);
}

TEST_CASE("rewrite: errors of the owner and of the caller change nothing") {
  Slam slam(joined_by(GENERATE(from_range(testing::networks()))));
  const auto why = [&](const std::string& id, const TimeInterval& interval,
                       const std::vector<EdgeSample>& samples) {
    const auto done = slam.client->rewrite(id, interval, samples);
    return done ? "done" : outcome(done) + ": " + done.error().message;
  };
  const TimeInterval interval{ms(100), ms(200)};
  const std::vector<EdgeSample> good{{ms(150), along_x(1)}};
  CHECK_THAT(why("nobody", interval, good), ContainsSubstring("unknown_frame"));
  CHECK_THAT(why("fixed", interval, good), ContainsSubstring("static"));
  CHECK_THAT(why("odom", interval, {}), ContainsSubstring("invalid_input"));
  CHECK_THAT(why("odom", {ms(100), ms(120)}, good), ContainsSubstring("outside"));
  CHECK_THAT(why("odom", {ms(200), ms(100)}, good), ContainsSubstring("invalid_input"));
  auto samples = saying(1, 100, 200);
  std::swap(samples[3], samples[4]);
  CHECK_THAT(why("odom", interval, samples), ContainsSubstring("not later"));
  samples = saying(1, 100, 200);
  samples[5].X_PC.pose = Pose::trusted(Eigen::Quaterniond::Identity(), {std::nan(""), 0, 0});
  CHECK_THAT(why("odom", interval, samples), ContainsSubstring("finite"));
  std::vector<EdgeSample> many;
  for (std::size_t i = 0; i <= kMaxRewritten; ++i) {
    many.push_back({ms(100) + std::chrono::nanoseconds(i), along_x(1)});
  }
  CHECK_THAT(why("odom", interval, many), ContainsSubstring("too_much"));
  for (std::int64_t t = 100; t <= 200; t += 10) {
    CHECK(x_of(slam.client->lookup("map", "odom", query(t))) == static_cast<double>(t));
  }
  CHECK(slam.client->rewrite("odom", interval, good));
}

TEST_CASE("rewrite: who looks up or watches has one history or the other") {
  const int transport = GENERATE(from_range(testing::networks()));
  Slam slam(joined_by(transport));
  auto watch = slam.client->watch("map", "odom");
  REQUIRE(watch);
  constexpr std::int64_t kFrom = 4000;
  constexpr std::int64_t kTo = 4800;
  REQUIRE(slam.client->rewrite("odom", {ms(kFrom), ms(kTo)}, saying(-1, kFrom, kTo)));
  REQUIRE(slam.node->update("odom", along_x(0), ms(kEnd + 10)));
  REQUIRE(eventually([&] { return x_of(watch->lookup(query(4500))) == -1; }));

  // In the interval all say the number of a rewrite, so between two samples as well.
  std::atomic<bool> stop{false};
  std::atomic<int> torn{0};
  std::atomic<int> seen{0};
  const auto look = [&](std::uint64_t seed, auto lookup) {
    Random random(seed);
    double last = 0;
    while (!stop) {
      const double x =
          x_of(lookup(query(kFrom + static_cast<std::int64_t>(random.index(kTo - kFrom + 1)))));
      if (std::isnan(x)) continue;
      if (x != std::floor(x) || x > last) ++torn;
      if (x < last) ++seen;
      last = std::min(last, x);
    }
  };
  std::vector<std::thread> readers;
  readers.emplace_back(
      [&] { look(1, [&](const Query& q) { return slam.node->lookup("map", "odom", q); }); });
  readers.emplace_back(
      [&] { look(2, [&](const Query& q) { return slam.client->lookup("map", "odom", q); }); });
  readers.emplace_back([&] { look(3, [&](const Query& q) { return watch->lookup(q); }); });
  int k = 2;
  for (; k < 60 || (seen <= 20 && k < 20'000); ++k) {
    REQUIRE(slam.client->rewrite("odom", {ms(kFrom), ms(kTo)}, saying(-k, kFrom, kTo)));
  }
  CHECK(eventually([&] { return x_of(watch->lookup(query(4500))) == 1 - k; }));
  stop = true;
  for (std::thread& reader : readers) reader.join();
  CHECK(torn == 0);
  CHECK(seen > 20);
}

TEST_CASE("rewrite: velocities, motions and clouds between two instants are of one history") {
  Slam slam(joined_by(GENERATE(from_range(testing::networks()))));
  const TimeInterval interval{ms(1000), ms(4000)};
  REQUIRE(slam.node->rewrite("odom", interval, saying(0, 1000, 4000)));
  REQUIRE(slam.node->update("fixed", along_x(1)));
  std::atomic<bool> stop{false};
  CloudQuery cloud;
  cloud.stamps = {ms(1500), ms(3500)};
  cloud.fixed = "map";
  // The robot rests, each time elsewhere.
  std::thread rewrites([&] {
    for (int i = 1; !stop; ++i) {
      (void)slam.node->rewrite("odom", interval, saying(i, 1000, 4000));
      std::this_thread::sleep_for(1ms);
    }
  });
  for (Client* client : {&*slam.client, static_cast<Client*>(&*slam.node)}) {
    int moved = 0;
    int seen = 0;
    std::set<std::string> errors;
    const auto begin = std::chrono::steady_clock::now();
    const auto passed = [&] { return std::chrono::steady_clock::now() - begin; };
    while (passed() < 400ms || (seen < 20 && passed() < 20s)) {
      const auto velocity = client->velocity("map", "odom", {ms(2500), 2000ms});
      if (velocity && velocity->linear.x() != 0) ++moved;
      const auto X = client->lookup("odom", query(1500), "odom", query(3500), "map");
      if (X && X->pose.translation().x() != 0) ++moved;
      const auto points =
          client->transform_cloud("odom", "odom", Eigen::Matrix3Xd::Zero(3, 2), cloud);
      if (points && !points->points.isZero()) ++moved;
      if (!points) errors.insert(outcome(points));
      seen += velocity && X && points ? 1 : 0;
      if (!velocity) errors.insert(outcome(velocity));
      if (!X) errors.insert(outcome(X));
    }
    CHECK(errors.empty());
    CHECK(moved == 0);
    CHECK(seen >= 20);
  }
  stop = true;
  rewrites.join();
}

TEST_CASE("rewrite: the last transform is shown, however early the past that was rewritten ends") {
  Slam slam(joined_by(testing::networks().front()));
  REQUIRE(slam.node->add("lamp", "odom", along_x(0), "slam"));
  for (const std::int64_t t : {std::int64_t{0}, kEnd}) {
    REQUIRE(slam.node->update("lamp", along_x(0), ms(t)));
  }
  // In its own memory.
  const auto path = slam.node->watch("map", "lamp");
  REQUIRE(path);
  const auto shown = [&] {
    const auto X = path->latest();
    return X && X->stamp ? nanoseconds(*X->stamp) / kMs : -1;
  };
  REQUIRE(eventually([&] { return shown() == kEnd; }));
  const std::uint64_t messages = path->messages();
  REQUIRE(slam.node->rewrite("odom", {ms(0), ms(kEnd)}, saying(1, 0, 4000)));
  REQUIRE(path->wait_for_more(messages, std::chrono::steady_clock::now() + 10s));
  CHECK(shown() == 4000);
  // The edges have no instant in common any more.
  REQUIRE(slam.node->rewrite("odom", {ms(0), ms(kEnd + 1000)}, {{ms(kEnd + 1000), along_x(1)}}));
  CHECK(eventually([&] { return shown() == 4000; }));
}

TEST_CASE("rewrite: a recording has both, what was believed before and what after") {
  Slam slam(joined_by(GENERATE(from_range(testing::networks()))));
  const auto path = std::filesystem::temp_directory_path() /
                    ("tfdude-rewrite-" + std::to_string(getpid()) + ".mcap");
  std::filesystem::remove(path);
  std::mutex mutex;
  Time now = ms(1'000'000);  // of the recorder
  std::size_t values = 0;
  std::optional<Time> kept_before;
  {
    auto writer = RecordingWriter::create(path, now);
    REQUIRE(writer);
    const auto add = [&](const PartitionNews& news) {
      const std::lock_guard<std::mutex> lock(mutex);
      if (const auto* told = std::get_if<ValuesNews>(&news.what)) {
        for (const WatchedValue& value : told->values) {
          ++values;
          if (value.kept_before) kept_before = value.kept_before;
        }
      }
      (void)writer->add(news, now);
    };
    const auto has = [&](std::size_t count) {
      const std::lock_guard<std::mutex> lock(mutex);
      return values >= count;
    };
    auto watch = slam.client->watch_partition("slam", {0, add});
    REQUIRE(watch);
    REQUIRE(eventually([&] { return has(1); }));
    for (std::int64_t t = kEnd + 10; t <= kEnd + 2000; t += 10) {
      REQUIRE(slam.node->update("odom", along_x(static_cast<double>(t)), ms(t)));
    }
    REQUIRE(eventually([&] { return has(200); }));
    {
      const std::lock_guard<std::mutex> lock(mutex);
      now = ms(2'000'000);
      values = 0;
    }
    const auto samples = saying(7, kEnd + 1000, kEnd + 1500);
    REQUIRE(slam.client->rewrite("odom", {ms(kEnd + 1000), ms(kEnd + 1500)}, samples));
    REQUIRE(eventually([&] { return has(samples.size() + 50); }));
    CHECK(kept_before == ms(kEnd + 1000));
    const std::lock_guard<std::mutex> lock(mutex);
    REQUIRE(writer->finish(now));
  }
  auto recording = Recording::open(path);
  REQUIRE(recording);
  const auto believed = [&](std::int64_t t, std::int64_t when) {
    recording->seek(ms(when));
    return x_of(recording->lookup("map", "odom", query(t)));
  };
  CHECK(believed(kEnd + 1250, 1'500'000) == kEnd + 1250);
  CHECK(believed(kEnd + 1250, 2'000'000) == 7);
  CHECK(believed(kEnd + 900, 2'000'000) == kEnd + 900);
  CHECK(believed(kEnd + 1510, 2'000'000) == kEnd + 1510);
  std::filesystem::remove(path);
}

TEST_CASE("rewrite: ten minutes at 100 Hz reach who watches, as one commit") {
  Slam slam(joined_by(GENERATE(from_range(testing::networks()))));
  Random random(10);
  INFO("seed " << random.seed());
  std::vector<EdgeSample> samples;
  for (std::int64_t i = 0; i < 60'000; ++i) samples.push_back({ms(10 * i), random.transform()});
  std::mutex mutex;
  std::size_t newest = 0;  // values of the last message
  std::size_t total = 0;
  const auto listen = [&](const PartitionNews& news) {
    const std::lock_guard<std::mutex> lock(mutex);
    const auto* values = std::get_if<ValuesNews>(&news.what);
    if (values == nullptr) return;
    newest = values->values.size();
    total += newest;
  };
  auto watch = slam.client->watch_partition("slam", {0, listen});
  auto path = slam.client->watch("map", "odom");
  REQUIRE(watch);
  REQUIRE(path);
  const auto has = [&](std::size_t count) {
    const std::lock_guard<std::mutex> lock(mutex);
    return total >= count;
  };
  REQUIRE(eventually([&] { return has(1); }));
  REQUIRE(eventually([&] { return path->lookup({}).has_value(); }));
  // The first push has all values.
  REQUIRE(slam.node->update("odom", along_x(1), ms(kEnd + 1)));
  REQUIRE(eventually([&] { return x_of(path->lookup({})) == 1; }));
  {
    const std::lock_guard<std::mutex> lock(mutex);
    total = 0;
  }
  REQUIRE(slam.client->rewrite("odom", {ms(0), ms(600'000)}, samples));
  REQUIRE(eventually([&] { return has(samples.size()); }));
  REQUIRE(eventually([&] {
    const auto X = path->lookup({});
    return X && testing::transform_diff(*X, samples.back().X_PC, 1e-9).empty();
  }));
  const std::lock_guard<std::mutex> lock(mutex);
  CHECK(newest == samples.size());
}

TEST_CASE("rewrite: ten minutes at 100 Hz", "[.measure]") {
  const int transport = GENERATE(from_range(testing::networks()));
  Slam slam(joined_by(transport));
  Random random(9);
  std::vector<EdgeSample> samples;
  for (std::int64_t i = 0; i < 60'000; ++i) {
    samples.push_back({ms(10 * i), random.transform()});
  }
  for (const bool own : {true, false}) {
    for (EdgeSample& one : samples) {
      if (!own) one.X_PC.covariance = samples[0].X_PC.covariance;
    }
    for (Client* client : {static_cast<Client*>(&*slam.node), &*slam.client}) {
      for (int i = 0; i < 5; ++i) {
        const auto begin = std::chrono::steady_clock::now();
        REQUIRE(client->rewrite("odom", {ms(0), ms(600'000)}, samples));
        const std::chrono::duration<double, std::milli> took =
            std::chrono::steady_clock::now() - begin;
        WARN((transport == 0 ? "loopback, " : "DDS, ")
             << (client == &*slam.client ? "a client, " : "the owner, ")
             << (own ? "each its covariance: " : "one covariance: ") << took.count() << " ms");
      }
    }
  }
}

}  // namespace tfdude
