#pragma once

#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <functional>
#include <string>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include "support/forest_support.hpp"
#include "support/random.hpp"
#include "support/shared_forest.hpp"
#include "tree/remote_edges.hpp"

// An owner that writes at full speed while others read in its memory.
namespace tfdude::testing {

inline constexpr int kLinks = 12;

[[nodiscard]] inline std::string link_of(int i) { return "link " + std::to_string(i); }

/// Says `k` in every part: k metres along x, k² along z, a variance of k m².
[[nodiscard]] inline Transform saying(int k) {
  Covariance::Upper upper{};
  upper[0] = k;
  return {Pose::trusted(Eigen::Quaterniond::Identity(), {1.0 * k, 0, 1.0 * k * k}),
          Covariance::trusted(upper)};
}

/// The k that all edges of a path say; -1 if they do not say the same. By Cauchy-Schwarz, the sum
/// of squares tells: edges · Σk² = (Σk)² only where all k are equal. All numbers are exact.
[[nodiscard]] inline int one_saying(const Transform& X, int edges) {
  const Eigen::Vector3d sum = X.pose.translation();
  const bool one = edges * sum.z() == sum.x() * sum.x() &&
                   X.covariance.of_specified().upper()[0] == std::abs(sum.x());
  const double k = sum.x() / edges;
  return one && k == std::floor(k) ? static_cast<int>(k) : -1;
}

/// Runs a function again and again, in another process or thread, until it is destroyed.
class Repeater {
 public:
  enum class In { kProcess, kThread };

  Repeater(In in, std::function<void()> round) {
    if (in == In::kThread) {
      thread_ = std::thread([this, round = std::move(round)] {
        while (!stop_) round();
      });
      return;
    }
    process_ = fork();
    if (process_ != 0) return;
    while (true) round();
  }
  ~Repeater() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    if (process_ <= 0) return;
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
  }
  Repeater(const Repeater&) = delete;
  Repeater& operator=(const Repeater&) = delete;

 private:
  std::atomic<bool> stop_{false};
  std::thread thread_;
  pid_t process_ = 0;
};

/// An owner that another process may write to. It is never destroyed: its destructor would follow
/// what the other process has left when it was killed.
[[nodiscard]] inline SharedForest& left_forest() {
  static auto* const all = new std::vector<SharedForest*>;
  all->push_back(new SharedForest);
  return *all->back();
}

/// A race has seen so many states at least, or has taken too long.
inline constexpr std::uint64_t kStates = 200;
[[nodiscard]] inline bool goes_on(std::uint64_t n, std::uint64_t lookups, std::uint64_t states) {
  constexpr std::uint64_t kTooLong = 100;
  return n < lookups || (states <= kStates && n < kTooLong * lookups);
}

/// An owner of a chain of links, and a reader that has its structure.
struct Chain {
  Chain() {
    link(0, "");
    for (int i = 1; i <= kLinks; ++i) link(i, link_of(i - 1));
    others.attach(1, arm.seen(), nullptr);
    bound = here.bind(link_of(0), link_of(kLinks), others);
    for (int i = 1; i <= kLinks; ++i) batch.push_back({*arm.forest.find(link_of(i)), {}});
  }
  void link(int i, const std::string& parent) {
    (void)arm.forest.add(link_of(i), parent, saying(1));
    (void)here.put_remote(link_of(i), parent, 1);
  }
  void say(int k) {
    for (HandleUpdate& one : batch) one.X_PC = saying(k);
    (void)arm.forest.update(batch);
  }

  SharedForest& arm = left_forest();
  Forest here;
  RemoteEdges others;
  std::size_t bound = 0;
  std::vector<HandleUpdate> batch;
};

struct Seen {
  std::uint64_t right = 0;
  std::uint64_t torn = 0;
  std::uint64_t back = 0;
  std::uint64_t given_up = 0;
  std::uint64_t states = 0;
};

/// Looks the whole chain up so often while its owner writes all of it in each commit.
[[nodiscard]] inline Seen race_for_batches(Repeater::In in, std::uint64_t lookups) {
  Chain chain;
  int k = 1;
  const Repeater writer(in, [&] { chain.say(++k); });
  Seen seen;
  int last = 0;
  for (std::uint64_t n = 0; goes_on(n, lookups, seen.states); ++n) {
    const auto X = chain.here.lookup(link_of(0), link_of(kLinks), {}, chain.others);
    if (!X) {
      ++seen.given_up;
      continue;
    }
    const int said = one_saying(*X, kLinks);
    ++(said < 0 ? seen.torn : seen.right);
    if (said >= 0 && said < last) ++seen.back;
    if (said > last) ++seen.states;
    last = std::max(last, said);
  }
  return seen;
}

/// As race_for_batches(), of edges whose errors share a source: each has a standard deviation of k
/// m by it, so that the path has one of so many times that.
[[nodiscard]] inline Seen race_for_correlations(Repeater::In in, std::uint64_t lookups) {
  Chain chain;
  Correlation said;
  said.common_errors = {{"shared", false, Loading::Zero(6, 3)}};
  std::vector<CorrelatedUpdate> batch;
  for (const HandleUpdate& one : chain.batch) batch.push_back({one.frame, {}, &said, {}});
  const auto write = [&](int k) {
    said.common_errors[0].loading(0, 1) = k;
    // So that blocks of many sizes are used again.
    said.common_errors[0].source = "shared" + std::string(static_cast<std::size_t>(k % 200), '+');
    for (CorrelatedUpdate& one : batch) one.X_PC = saying(k);
    (void)chain.arm.forest.update_correlated(batch);
  };
  int k = 1;
  write(k);
  const Repeater writer(in, [&] { write(++k); });
  Seen seen;
  int last = 0;
  for (std::uint64_t n = 0; goes_on(n, lookups, seen.states); ++n) {
    const auto X = chain.here.lookup(link_of(0), link_of(kLinks), Query{}, chain.others);
    if (!X) {
      ++seen.given_up;
      continue;
    }
    const double sum = X->pose.translation().x();
    const double shared = X->covariance.of_specified().upper()[0] - std::abs(sum);
    const int now = static_cast<int>(sum) / kLinks;
    const bool whole = now * kLinks == sum && std::abs(shared - sum * sum) <= 1e-9 * sum * sum &&
                       X->basis.sources.size() == 1 &&
                       X->basis.sources[0].size() == 6 + static_cast<std::size_t>(now % 200);
    ++(whole ? seen.right : seen.torn);
    if (now < last) ++seen.back;
    if (now > last) ++seen.states;
    last = std::max(last, now);
  }
  return seen;
}

/// Looks up at instants of the last samples, while the owner adds samples, some of them late, and
/// drops others. All edges turn at one rate, so the right answer is known.
[[nodiscard]] inline Seen race_for_histories(Repeater::In in, std::uint64_t lookups) {
  constexpr double kRate = 1e-4;  // [m/s]
  constexpr std::int64_t kStart = 1'000'000'000'000;
  constexpr std::int64_t kStep = 1'000'000;
  Chain chain;
  const auto value_at = [](std::int64_t t) {
    return along_x(kRate * static_cast<double>(t - kStart) * 1e-9);
  };
  EdgeTiming timing;
  timing.count = 48;
  timing.restart_after = 0;
  timing.max_ahead = std::chrono::nanoseconds::max();
  for (int i = 1; i <= kLinks; ++i) (void)chain.arm.forest.set_timing(link_of(i), timing);
  std::int64_t t = kStart;
  Random late(3);
  const auto put = [&](std::int64_t stamp) {
    for (HandleUpdate& one : chain.batch) one.X_PC = value_at(stamp);
    (void)chain.arm.forest.update(chain.batch, time_of(stamp));
  };
  const auto round = [&] {
    put(t += kStep);
    if (late.index(4) == 0) put(t - kStep / 2 - static_cast<std::int64_t>(late.index(20)) * kStep);
  };
  for (int i = 0; i < 300; ++i) round();
  const Repeater writer(in, round);
  Seen seen;
  Random random(4);
  std::int64_t newest = t;
  for (std::uint64_t n = 0; goes_on(n, lookups, seen.states); ++n) {
    Query query;
    if (n % 16 != 0)
      query.at = time_of(newest - static_cast<std::int64_t>(random.index(10'000'000)));
    const auto X = chain.here.lookup(link_of(0), link_of(kLinks), query, chain.others);
    if (!X) {
      ++seen.given_up;
      continue;
    }
    const std::int64_t at = nanoseconds(*X->stamp);
    const double expected = kLinks * value_at(at).pose.translation().x();
    ++(std::abs(X->pose.translation().x() - expected) < 1e-12 ? seen.right : seen.torn);
    if (at > newest) {
      newest = at;
      ++seen.states;
    }
  }
  return seen;
}

/// Looks an edge up while its frames are moved, removed and added again, and their slots reused.
/// The value of the edge between p and c is always the same.
[[nodiscard]] inline Seen race_for_slots(Repeater::In in, std::uint64_t lookups) {
  SharedForest& arm = left_forest();
  Forest& forest = arm.forest;
  (void)forest.add("root", "", along_x(0));
  (void)forest.add("p", "root", along_x(100));
  (void)forest.add("q", "root", along_x(200));
  (void)forest.add("c", "p", along_x(1));
  Forest here;
  (void)here.put_remote("root", "", 1);
  (void)here.put_remote("p", "root", 1);
  (void)here.put_remote("c", "p", 1);
  RemoteEdges others;
  others.attach(1, arm.seen(), nullptr);
  Random dice(9);
  const Repeater writer(in, [&] {
    switch (dice.index(4)) {
      case 0:
        (void)forest.move("c", "q", {{}, {}, {}});
        (void)forest.update("c", along_x(2));
        break;
      case 1:
        (void)forest.remove("c");
        (void)forest.add("c", "p", along_x(1));
        break;
      case 2: {
        const std::string other = "z" + std::to_string(dice.index(7));
        (void)forest.remove("c");
        (void)forest.add(other, "root", along_x(3));
        (void)forest.remove(other);
        (void)forest.add("c", "p", along_x(1));
        break;
      }
      default:
        (void)forest.remove("c");
        (void)forest.remove("p");
        (void)forest.add("y", "root", along_x(300));
        (void)forest.add("c", "y", along_x(4));
        (void)forest.remove("c");
        (void)forest.remove("y");
        (void)forest.add("p", "root", along_x(100));
        (void)forest.add("c", "p", along_x(1));
    }
  });
  Seen seen;
  for (std::uint64_t n = 0; goes_on(n, lookups, seen.states); ++n) {
    const auto X = here.lookup("p", "c", {}, others);
    if (!X) {
      ++seen.given_up;
      if (here.bind("p", "c", others) > 0) ++seen.states;
      continue;
    }
    ++(X->pose.translation().x() == 1 ? seen.right : seen.torn);
  }
  return seen;
}

}  // namespace tfdude::testing
