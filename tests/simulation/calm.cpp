#include "simulation/calm.hpp"

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "simulation/process.hpp"
#include "simulation/wire_size.hpp"

namespace tfdude::simulation {
namespace {

constexpr Instant kObserveEvery = milliseconds(100);
constexpr Instant kLongestWait = milliseconds(30'000);
// Longer than owners wait to tell how many others they hear.
constexpr Instant kSettle = milliseconds(1'000);
// Longer than participants ask somebody for signs of life whom they have sent something.
constexpr Instant kQuiet = milliseconds(2'500);
constexpr Instant kIdle = milliseconds(1'500);
constexpr Instant kBetween = milliseconds(20);
constexpr std::size_t kMostChanges = 10;  // of each kind
constexpr std::size_t kChildren = 10;     // of a frame

double seconds(Instant time) { return std::chrono::duration<double>(time).count(); }

// Calls combine(a, b) for the same numbers of two loads.
template <class Combine>
Load combined(const Load& a, const Load& b, Combine combine) {
  const auto counts = [&](const Count& one, const Count& other) {
    return Count{combine(one.messages, other.messages), combine(one.bytes, other.bytes)};
  };
  return {counts(a.written, b.written), counts(a.sent, b.sent), counts(a.received, b.received),
          combine(a.heard, b.heard), combine(a.probes, b.probes)};
}

Load divided(const Load& load, double by) {
  return combined(load, load, [by](double number, double) { return number / by; });
}

std::string frame_of(std::size_t partition, std::size_t number) {
  return "p" + std::to_string(partition) + "_" + std::to_string(number);
}

/// A change, or a lookup, by one participant of another one's frames.
struct Kind {
  const char* name;
  /// @param owner  the number of the partition concerned
  std::shared_ptr<Task> (*task)(Process& caller, std::size_t owner);
};

std::shared_ptr<Task> add_to(Process& caller, std::size_t owner) {
  return RunningCall::change([&caller, owner] {
    return route_add(caller.forest(), caller.directory(), "added" + std::to_string(owner),
                     {frame_of(owner, 0), {}}, "")
        .map([](Part&& part) { return std::vector<Part>{std::move(part)}; });
  });
}

std::shared_ptr<Task> update_of(Process& caller, std::size_t owner) {
  return RunningCall::change([&caller, owner] {
    return route_update(caller.forest(), caller.directory(),
                        std::vector<EdgeUpdate>{{"added" + std::to_string(owner), {}}});
  });
}

// Between two neighbours in the chain.
std::shared_ptr<Task> lookup_in(Process& caller, std::size_t owner) {
  return caller.lookup("added" + std::to_string(owner), frame_of(owner, 0));
}

class Calm {
 public:
  explicit Calm(const CalmSize& size)
      : size_(size),
        plan_(plan_of(size)),
        timeline_(plan_.seed),
        network_(timeline_, plan_),
        random_(plan_.seed),
        traffic_(wire_size),
        invariants_([this](const auto& kind, const auto& what) { violation(kind, what); }),
        surroundings_{timeline_,
                      network_,
                      plan_,
                      random_,
                      [](const std::string&) {},
                      [this](const auto& kind, const auto& what) { violation(kind, what); },
                      [](const std::string&) {},
                      [](std::size_t, std::size_t) {},
                      [](const std::string&) { return std::shared_ptr<Process>(); },
                      {},
                      false,
                      {},
                      steps_,
                      invariants_} {
    steps_.add({}, {"start"});
    network_.count(traffic_);
  }

  Result<CalmRun> run() {
    CalmRun run;
    for (std::size_t i = 0; i < size_.partitions; ++i) start(i, configuration(i));
    run.served_s = until([](Process& one) { return one.serves(); });
    run.known_s = until([this](Process& one) { return knows_all(one); });
    if (!failure_) advance(kSettle);
    run.start = spent(1);
    if (!failure_) advance(kIdle);
    run.idle = spent(seconds(kIdle));
    run.add = each({"add", add_to});
    frames_ += changes();
    run.update = each({"update", update_of});
    run.lookup = each({"lookup", lookup_in});
    run.join = join();
    if (failure_) return tl::unexpected(*failure_);
    return run;
  }

 private:
  static Plan plan_of(const CalmSize& size) {
    Plan plan;
    plan.seed = 1;
    plan.owners = size.partitions;
    plan.delay = std::chrono::microseconds(100);
    plan.tells_count = true;
    return plan;
  }

  void violation(const std::string& kind, const std::string& what) {
    fail_with({Errc::kState, kind + ": " + what});
  }
  void fail_with(Error error) {
    if (!failure_) failure_ = std::move(error);
  }

  void advance(Instant time) {
    const Instant until = timeline_.now() + time;
    while (timeline_.step(until)) {
    }
  }

  [[nodiscard]] std::vector<FrameSpec> configuration(std::size_t partition) const {
    const std::size_t own =
        size_.frames / size_.partitions + (partition < size_.frames % size_.partitions ? 1 : 0);
    std::vector<FrameSpec> frames;
    frames.push_back({frame_of(partition, 0), partition > 0 ? frame_of(partition - 1, 0) : "", {}});
    for (std::size_t i = 1; i < own; ++i) {
      frames.push_back({frame_of(partition, i), frame_of(partition, (i - 1) / kChildren), {}});
    }
    return frames;
  }

  void start(std::size_t partition, std::vector<FrameSpec> frames) {
    Process::Setting setting;
    setting.host = partition % Network::kMostHosts;
    setting.id = partition;
    setting.partition = "p" + std::to_string(partition);
    frames_ += frames.size();
    setting.configured = std::move(frames);
    setting.clock = &clock_;
    processes_.push_back(std::make_shared<Process>(surroundings_, setting));
    network_.join(processes_.back());
    processes_.back()->start();
  }

  [[nodiscard]] bool knows_all(Process& one) const {
    const auto others = one.directory().reachable_owners();
    if (!one.serves() || others.size() + 1 != processes_.size()) return false;
    std::size_t frames = one.member().partition()->frame_count();
    for (const Owner owner : others) frames += one.directory().info(owner).frames;
    return one.directory().complete() && frames == frames_;
  }

  // The time when this holds for all.
  template <class Holds>
  double until(Holds holds) {
    const auto missing = [&] {
      return std::find_if_not(processes_.begin(), processes_.end(),
                              [&](const auto& one) { return holds(*one); });
    };
    const Instant begin = timeline_.now();
    for (auto one = missing(); one != processes_.end() && !failure_; one = missing()) {
      if (timeline_.now() > begin + kLongestWait) {
        fail_with({Errc::kState, (*one)->partition() + " does not serve or know all frames"});
      }
      advance(kObserveEvery);
    }
    return seconds(timeline_.now());
  }

  // What was sent and received since the last call.
  Spent spent(double by) {
    std::vector<Load> loads = traffic_.take();
    loads.resize(processes_.size());
    Spent spent;
    for (Load& load : loads) {
      load = divided(load, by);
      spent.all = combined(spent.all, load, std::plus<>());
      spent.most = combined(spent.most, load, [](double a, double b) { return std::max(a, b); });
    }
    spent.mean = divided(spent.all, static_cast<double>(loads.size()));
    return spent;
  }

  [[nodiscard]] std::size_t changes() const { return std::min(kMostChanges, size_.partitions); }

  // Some participants make a change, or a lookup, one after the other.
  Spent each(const Kind& kind) {
    if (failure_) return {};
    const std::size_t count = changes();
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t owner = i * size_.partitions / count;
      const auto caller = processes_[(owner + 1) % size_.partitions];
      caller->begin(kind.name, kind.task(*caller, owner), [this](const Result<void>& outcome) {
        ++done_;
        if (!outcome) fail_with(outcome.error());
      });
      advance(kBetween);
    }
    advance(kQuiet);
    if (done_ != count) fail_with({Errc::kState, "a change does not end"});
    done_ = 0;
    Spent spent = this->spent(1);
    spent.all = divided(spent.all, static_cast<double>(count));
    spent.mean = divided(spent.mean, static_cast<double>(count));
    return spent;
  }

  Spent join() {
    const std::size_t partition = processes_.size();
    start(partition, {{frame_of(partition, 0), frame_of(partition - 1, 0), {}}});
    (void)until([this](Process& one) { return knows_all(one); });
    if (!failure_) advance(kSettle);
    return spent(1);
  }

  const CalmSize size_;
  const Plan plan_;
  Timeline timeline_;
  Network network_;
  testing::Random random_;
  Traffic traffic_;
  Invariants invariants_;
  Steps steps_;
  Surroundings surroundings_;
  const Clock clock_;
  std::vector<std::shared_ptr<Process>> processes_;
  std::size_t frames_ = 0;  // of all configurations, and those that were added
  std::size_t done_ = 0;
  std::optional<Error> failure_;
};

}  // namespace

Result<CalmRun> run_calm(const CalmSize& size) {
  if (size.partitions < 2 || size.frames < size.partitions) {
    return fail(Errc::kInvalidInput, "a run needs two partitions, and a frame for each");
  }
  return Calm(size).run();
}

}  // namespace tfdude::simulation
