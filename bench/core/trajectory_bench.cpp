// One pair of frames at many instants of a recording: a path of ten edges that move, with
// covariance, as a recorder writes them. Prints a line of JSON for each figure.
//
//   trajectory_bench [MINUTES [INSTANTS [RATE]]]      20, 300,000 and 100 Hz by default
//
// Keys: trajectory/KIND/WHAT. In the file of the kind
//   same     the covariance of an edge is always the same, so it is written seldom
//   other    each sample has another one
// and
//   first     the call, and to open the file
//   again     the same call once more
//   shuffled  the same, with the instants in any order
//   single    lookup_at(), at each of 50 instants in any order

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <type_traits>
#include <unistd.h>
#include <utility>
#include <vector>

#include "tfdude/recording/recording.hpp"
#include "tfdude/recording/recording_writer.hpp"

#include "support/random.hpp"
#include "support/series.hpp"

namespace {

using namespace tfdude;

constexpr std::size_t kEdges = 10;
constexpr int kRepetitions = 3;
constexpr std::size_t kSingle = 50;
constexpr auto kStart = std::chrono::seconds(1'000'000'000);

struct Size {
  double minutes = 20;
  std::size_t instants = 300'000;
  double rate = 100;

  [[nodiscard]] std::size_t samples() const {
    return static_cast<std::size_t>(minutes * 60 * rate);
  }
  [[nodiscard]] Time at(double sample) const {
    return Time(kStart) + std::chrono::nanoseconds(std::llround(sample * 1e9 / rate));
  }
};

template <class T>
T good(Result<T>&& result) {
  if (!result) {
    std::fprintf(stderr, "%s\n", result.error().message.c_str());
    std::exit(1);
  }
  if constexpr (!std::is_void_v<T>) return *std::move(result);
}

std::string frame(std::size_t number) { return "link_" + std::to_string(number); }

/// Each edge swings by half a radian, once in two seconds.
class Swinging {
 public:
  explicit Swinging(bool same) : same_(same) {
    testing::Random random(11);
    for (Edge& edge : edges_)
      edge = {random.direction(), random.uniform(0, 6), random.covariance()};
  }

  [[nodiscard]] Transform at(std::size_t edge, double seconds) const {
    const Edge& one = edges_[edge];
    const double angle = 0.5 * std::sin(3.14 * seconds + one.phase);
    const Eigen::Quaterniond q(Eigen::AngleAxisd(angle, one.axis));
    Transform X{Pose::trusted(q, {0.1, 0, 0}), StatedCovariance(one.covariance)};
    if (!same_) {
      auto upper = one.covariance.upper();
      for (double& number : upper) number *= 1.5 + std::sin(seconds);
      X.covariance = StatedCovariance(Covariance::trusted(upper));
    }
    return X;
  }

 private:
  struct Edge {
    Eigen::Vector3d axis;
    double phase = 0;
    Covariance covariance;
  };
  bool same_;
  Edge edges_[kEdges];
};

void record(const std::string& file, const Size& size, bool same) {
  auto writer = good(RecordingWriter::create(file, size.at(0)));
  FramesNews frames;
  frames.frames.push_back({frame(0), ""});
  for (std::size_t i = 0; i < kEdges; ++i) frames.frames.push_back({frame(i + 1), frame(i)});
  std::sort(frames.frames.begin(), frames.frames.end(),
            [](const WatchedFrame& a, const WatchedFrame& b) { return a.id < b.id; });
  frames.incarnation = 1;
  good(writer.add({"robot", ReachNews{true, {}}}, size.at(0)));
  good(writer.add({"robot", frames}, size.at(0)));
  const Swinging swinging(same);
  for (std::size_t k = 0; k < size.samples(); ++k) {
    const auto sample = static_cast<double>(k);
    ValuesNews news{k + 1, {}};
    for (std::uint32_t i = 0; i < frames.frames.size(); ++i) {
      if (frames.frames[i].parent.empty()) continue;
      WatchedValue value{i, size.at(sample), swinging.at(i % kEdges, sample / size.rate)};
      if (k == 0) value.begins = Covariance();
      news.values.push_back(std::move(value));
    }
    good(writer.add({"robot", std::move(news)}, size.at(sample + 0.2)));
  }
  good(writer.finish(size.at(static_cast<double>(size.samples()))));
}

class Timed {
 public:
  explicit Timed(std::string key) : series_(std::move(key), "ms") {}
  template <class Measured>
  void measure(Measured measured, std::size_t count = 1) {
    const auto begin = bench::Clock::now();
    measured();
    series_.add(bench::microseconds_since(begin) / 1e3 / static_cast<double>(count));
    series_.end_repetition();
  }
  void print() const { series_.print(); }

 private:
  bench::Series series_;
};

void ask(const std::string& file, const Size& size, const std::string& kind) {
  testing::Random random(12);
  std::vector<Time> shuffled;
  for (std::size_t i = 0; i < size.instants; ++i) {
    shuffled.push_back(size.at(random.uniform(1, static_cast<double>(size.samples()) - 2)));
  }
  std::vector<Time> sorted = shuffled;
  std::sort(sorted.begin(), sorted.end());
  const auto call = [&](Recording& recording, const std::vector<Time>& instants) {
    const Trajectory all = recording.trajectory(frame(0), frame(kEdges), instants);
    if (all.missing.empty()) return;
    std::fprintf(stderr, "%s\n", all.missing.front().error.message.c_str());
    std::exit(1);
  };
  Timed first("trajectory/" + kind + "/first");
  Timed again("trajectory/" + kind + "/again");
  Timed any("trajectory/" + kind + "/shuffled");
  Timed single("trajectory/" + kind + "/single");
  const auto look_up = [&](Recording& recording) {
    for (std::size_t i = 0; i < kSingle; ++i) {
      good(recording.lookup_at(frame(0), frame(kEdges), shuffled[i]));
    }
  };
  for (int i = 0; i < kRepetitions; ++i) {
    std::optional<Recording> recording;
    first.measure([&] {
      recording = good(Recording::open(file));
      call(*recording, sorted);
    });
    again.measure([&] { call(*recording, sorted); });
    any.measure([&] { call(*recording, shuffled); });
    single.measure([&] { look_up(*recording); }, kSingle);
  }
  first.print();
  again.print();
  any.print();
  single.print();
}

}  // namespace

int main(int argc, char** argv) {
  Size size;
  if (argc > 1) size.minutes = std::atof(argv[1]);
  if (argc > 2) size.instants = static_cast<std::size_t>(std::atol(argv[2]));
  if (argc > 3) size.rate = std::atof(argv[3]);
  for (const bool same : {true, false}) {
    const std::string kind = same ? "same" : "other";
    const std::string file = (std::filesystem::temp_directory_path() /
                              ("trajectory-" + kind + "-" + std::to_string(getpid()) + ".mcap"))
                                 .string();
    record(file, size, same);
    std::fprintf(stderr, "%s: %ju bytes\n", kind.c_str(),
                 static_cast<std::uintmax_t>(std::filesystem::file_size(file)));
    ask(file, size, kind);
    std::filesystem::remove(file);
  }
}
