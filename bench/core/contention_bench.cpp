// One reader that looks up without pauses, alone and concurrently with one writer of 100 joints at
// 1 kHz, for tf-dude and for tf2's BufferCore on the same chain of 100 edges. The reader is on
// processor 0, the writer on processor 1.
//
//   contention_bench [SECONDS per repetition] [REPETITIONS]
//
// Keys: contention/WHO/READER/alone or /beside_writer (ns per lookup of 30 edges),
// contention/WHO/batch (us for 100 edges), contention/ours/torn (lookups that saw half of a batch).
// As a floor, contention/bare is the same for records of one cache line each, without a tree; and
// contention/line (ns) is the time of one cache line from one processor to the other. It depends on
// where the host runs the two: 30 to 330 ns were seen.

#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <pthread.h>
#include <thread>

#include "tfdude/client/node.hpp"
#include "tfdude/transport/loopback.hpp"

#include "core/trees.hpp"
#include "support/series.hpp"

namespace {

using namespace tfdude;
using bench::Clock;
using bench::Series;

constexpr std::size_t kJoints = 100;
constexpr std::size_t kDepth = 30;
constexpr int kLookupsPerSample = 16;  // because reading the clock takes as long as a lookup

void pin(std::size_t processor) {
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(processor, &set);
  if (pthread_setaffinity_np(pthread_self(), sizeof(set), &set) != 0) std::abort();
}

bench::Tree chain() {
  bench::Tree tree;
  tree.frames.push_back({"frame_0", "", {}});
  for (std::size_t i = 1; i <= kJoints; ++i) {
    tree.frames.push_back(
        {"frame_" + std::to_string(i), "frame_" + std::to_string(i - 1), Transform::exact({})});
  }
  tree.from = "frame_0";
  tree.to = "frame_" + std::to_string(kDepth);
  return tree;
}

/// Every joint of a batch is turned about z by the same angle, so a whole path is turned by kDepth
/// times this angle.
Pose turned(double angle) { return exp((Twist() << 0, 0, 0, 0, 0, angle).finished()); }

class Ours {
 public:
  Ours() : node_(*Node::open(LoopbackNetwork().join(), "bench", chain().frames)) {
    for (std::size_t i = 1; i <= kJoints; ++i) {
      batch_.push_back({*node_.find("frame_" + std::to_string(i)), Transform::exact({})});
    }
  }

  void write(double angle) {
    for (HandleUpdate& edge : batch_) edge.X_PC.pose = turned(angle);
    const auto start = Clock::now();
    if (!node_.update(batch_)) std::abort();
    written_in_us = bench::microseconds_since(start);
  }

  [[nodiscard]] Pose read() { return node_.lookup_pose(from_, to_).value(); }
  [[nodiscard]] Pose read_with_covariance() { return node_.lookup(from_, to_)->pose; }

  double written_in_us = 0;

 private:
  Node node_;
  const Handle from_ = *node_.find(chain().from);
  const Handle to_ = *node_.find(chain().to);
  std::vector<HandleUpdate> batch_;
};

class Tf2 {
 public:
  Tf2() {
    for (const FrameSpec& frame : chain().frames) {
      if (!frame.parent.empty()) batch_.push_back(bench::stamped(frame, ros::Time(1)));
    }
    write(0);
  }

  void write(double angle) {
    const auto q = turned(angle).rotation();
    stamp_ += ros::Duration(0, 1000000);
    for (auto& edge : batch_) {
      edge.header.stamp = stamp_;
      edge.transform.rotation.z = q.z();
      edge.transform.rotation.w = q.w();
    }
    const auto start = Clock::now();
    for (const auto& edge : batch_) buffer_.setTransform(edge, "bench", false);
    written_in_us = bench::microseconds_since(start);
  }

  [[nodiscard]] geometry_msgs::TransformStamped read() {
    return buffer_.lookupTransform(from_, to_, ros::Time(0));
  }

  double written_in_us = 0;

 private:
  tf2::BufferCore buffer_;
  const std::string from_ = chain().from;
  const std::string to_ = chain().to;
  std::vector<geometry_msgs::TransformStamped> batch_;
  ros::Time stamp_{2};
};

/// A record for each edge: a sequence number, odd while it is written, and the pose as a quaternion
/// and a translation.
class Bare {
 public:
  void write(double angle) {
    const auto q = turned(angle).rotation();
    const std::array<double, 7> values{q.w(), q.x(), q.y(), q.z(), 0, 0, 0};
    const auto start = Clock::now();
    for (Record& record : records_) {
      const std::uint64_t number = record.number.load(std::memory_order_relaxed);
      record.number.store(number + 1, std::memory_order_relaxed);
      std::atomic_thread_fence(std::memory_order_release);
      for (std::size_t i = 0; i < values.size(); ++i) {
        record.values[i].store(values[i], std::memory_order_relaxed);
      }
      record.number.store(number + 2, std::memory_order_release);
    }
    written_in_us = bench::microseconds_since(start);
  }

  [[nodiscard]] Pose read() const {
    Pose path;
    for (std::size_t i = 0; i < kDepth; ++i) path = path * records_[i].read();
    return path;
  }

  double written_in_us = 0;

 private:
  struct alignas(64) Record {
    [[nodiscard]] Pose read() const {
      for (;;) {
        const std::uint64_t before = number.load(std::memory_order_acquire);
        std::array<double, 7> v{};
        for (std::size_t i = 0; i < v.size(); ++i) v[i] = values[i].load(std::memory_order_relaxed);
        std::atomic_thread_fence(std::memory_order_acquire);
        if (before % 2 == 0 && number.load(std::memory_order_relaxed) == before) {
          return Pose::trusted({v[0], v[1], v[2], v[3]}, {v[4], v[5], v[6]});
        }
      }
    }

    std::atomic<std::uint64_t> number{0};
    std::array<std::atomic<double>, 7> values{1, 0, 0, 0, 0, 0, 0};
  };

  std::array<Record, kJoints> records_;
};

/// The time of one cache line from one processor to the other: two threads count up in turn.
void measure_line(int repetitions) {
  constexpr long kTurns = 20000;
  Series line("contention/line", "ns");
  for (int i = 0; i < repetitions; ++i) {
    alignas(64) std::atomic<long> count{0};
    const auto count_up_from = [&](long first) {
      for (long turn = first; turn < 2 * kTurns; turn += 2) {
        while (count.load(std::memory_order_acquire) != turn) {
        }
        count.store(turn + 1, std::memory_order_release);
      }
    };
    std::thread other([&] {
      pin(1);
      count_up_from(1);
    });
    const auto start = Clock::now();
    count_up_from(0);
    other.join();
    line.add(1e3 * bench::microseconds_since(start) / (2 * kTurns));
    line.end_repetition();
  }
  line.print();
}

/// Writes a batch every millisecond until it is destroyed.
template <class Who>
class Writer {
 public:
  Writer(Who& who, Series& batch) : thread_([this, &who, &batch] { run(who, batch); }) {}
  ~Writer() {
    stop_ = true;
    thread_.join();
  }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

 private:
  void run(Who& who, Series& batch) {
    pin(1);
    auto next = Clock::now();
    for (int i = 0; !stop_; ++i) {
      who.write(1e-3 * (i % 100));
      batch.add(who.written_in_us);
      std::this_thread::sleep_until(next += std::chrono::milliseconds(1));
    }
    batch.end_repetition();
  }

  std::atomic<bool> stop_{false};
  std::thread thread_;
};

template <class Read>
void read_for(double seconds, Series& series, Read read) {
  const auto start = Clock::now();
  while (bench::microseconds_since(start) < 1e6 * seconds) {
    const auto before = Clock::now();
    for (int i = 0; i < kLookupsPerSample; ++i) read();
    series.add(1e3 * bench::microseconds_since(before) / kLookupsPerSample);
  }
  series.end_repetition();
}

/// Measures alone and concurrently with the writer, in turns.
template <class Who, class Read>
void measure(const std::string& name, Who& who, Series& batch, double seconds, int repetitions,
             Read read) {
  Series alone(name + "/alone", "ns");
  Series beside(name + "/beside_writer", "ns");
  for (int i = 0; i < repetitions; ++i) {
    read_for(seconds, alone, read);
    const Writer<Who> writer(who, batch);
    read_for(seconds, beside, read);
  }
  alone.print();
  beside.print();
}

}  // namespace

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 0.5;
  const int repetitions = argc > 2 ? std::atoi(argv[2]) : 5;
  pin(0);
  Ours ours;
  Series ours_batch("contention/ours/batch", "us");
  Series torn("contention/ours/torn", "count");
  double torn_lookups = 0;
  const auto check = [&](const Pose& X) {
    // A whole batch turns the path by 30 times an integer number of milliradians, and by less than
    // half a turn.
    const double milliradians = log(X)[5] * 1e3 / kDepth;
    if (std::abs(std::remainder(milliradians, 1.0)) > 1e-6) ++torn_lookups;
  };
  measure("contention/ours/pose", ours, ours_batch, seconds, repetitions,
          [&] { (void)ours.read(); });
  measure("contention/ours/covariance", ours, ours_batch, seconds, repetitions,
          [&] { (void)ours.read_with_covariance(); });
  {
    Series checked("contention/ours/checked", "ns");
    const Writer<Ours> writer(ours, ours_batch);
    read_for(seconds, checked, [&] { check(ours.read()); });
  }
  torn.add(torn_lookups);
  torn.end_repetition();
  torn.print();
  ours_batch.print();
  Bare bare;
  Series bare_batch("contention/bare/batch", "us");
  measure("contention/bare/pose", bare, bare_batch, seconds, repetitions,
          [&] { (void)bare.read(); });
  bare_batch.print();
  measure_line(10 * repetitions);
  Tf2 tf2;
  Series tf2_batch("contention/tf2/batch", "us");
  measure("contention/tf2/pose", tf2, tf2_batch, seconds, repetitions, [&] { (void)tf2.read(); });
  tf2_batch.print();
  return 0;
}
