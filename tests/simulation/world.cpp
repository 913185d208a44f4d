#include "simulation/world.hpp"

#include <cstdio>
#include <utility>

#include "simulation/daemons.hpp"
#include "simulation/measurer.hpp"
#include "simulation/pacer.hpp"
#include "simulation/streamer.hpp"
#include "simulation/verdict.hpp"
#include "simulation/waiter.hpp"

namespace tfdude::simulation {
namespace {

constexpr std::size_t kMostFailures = 10;
// Longer than a participant takes to count as gone, to be discovered again, to claim its name and
// to yield.
constexpr Instant kRest = milliseconds(12000);

class World {
 public:
  World(const Plan& plan, bool trace)
      : plan_(plan),
        trace_(trace),
        timeline_(plan.seed),
        network_(timeline_, plan),
        random_(plan.seed ^ 0x776f726cU),
        invariants_([this](const auto& kind, const auto& what) { violation(kind, what); }),
        surroundings_{timeline_,
                      network_,
                      plan_,
                      random_,
                      [this](const std::string& step) { note(step); },
                      [this](const auto& kind, const auto& what) { violation(kind, what); },
                      [this](const std::string& what) { ++run_.counts[what]; },
                      [this](std::size_t actor, std::size_t operation) {
                        if (operation < kOperationsEach) {
                          run_.operations.push_back(number_of(actor, operation));
                        }
                      },
                      [this](const std::string& partition) { return serving(partition); },
                      {},
                      false,
                      {},
                      run_.steps,
                      invariants_},
        cast_(plan),
        clocks_(Network::kMostHosts),
        daemons_(surroundings_, cast_, clocks_,
                 [this](const auto& partition, Instant first) { lost_power(partition, first); }) {
    run_.steps.add({}, {"start"});
    timeline_.watch([this](const Touch& touch) { run_.steps.add(timeline_.now(), touch); },
                    [this](const Touch& touch) { look_at(touch); });
    for (Clock& clock : clocks_) {
      clock.ahead = Instant(static_cast<std::int64_t>(random_.uniform(-1, 1) *
                                                      static_cast<double>(plan.offset.count())));
      clock.drift = random_.uniform(-plan.drift, plan.drift);
    }
  }

  Run run() {
    daemons_.start();
    for (std::size_t i = 0; i < plan_.clients; ++i) cast_.authors.push_back(start<Author>(i));
    for (std::size_t i = 0; i < plan_.followers; ++i) cast_.followers.push_back(start<Follower>(i));
    for (std::size_t i = 0; i < plan_.samplers; ++i) cast_.samplers.push_back(start<Sampler>(i));
    for (std::size_t i = 0; i < plan_.waiters; ++i) start<Waiter>();
    for (std::size_t i = 0; i < plan_.streamers; ++i) start_streamer();
    for (std::size_t i = 0; i < plan_.measurers; ++i) start<Measurer>(i);
    for (std::size_t i = 0; i < plan_.pacers; ++i) start<Pacer>(i);
    for (const auto* faults : {&plan_.faults, &plan_.beside}) {
      for (const Fault& fault : *faults) {
        timeline_.at(fault.begin, {"fault"}, [this, &fault] { daemons_.begin(fault); });
        timeline_.at(fault.end, {"end of fault"}, [this, &fault] { daemons_.end(fault); });
      }
    }
    advance(plan_.storm);
    for (const auto& actor : cast_.actors) actor->stop();
    network_.set_loss(plan_.loss_after);
    for (const Fault& fault : plan_.lasting) daemons_.begin(fault);
    if (plan_.forgets) {
      timeline_.after(kForgetAfter, {"forget"}, [this] { forget_who_is_lost(); });
    }
    advance(plan_.storm + kRest);
    Verdict({plan_,
             cast_,
             frames_named(),
             {[this](const auto& kind, const auto& what) { violation(kind, what); },
              [this](const std::string& what, std::size_t n) { run_.counts[what] += n; },
              [this](Instant wait) { advance(timeline_.now() + wait); }}})
        .check();
    if (const Process* replaced = daemons_.replaced()) {
      violation("one that was replaced serves on", replaced->partition());
    }
    for (const auto& actor : cast_.actors) {
      for (const auto& [what, count] : actor->outcomes()) run_.counts[what] += count;
    }
    run_.duration = timeline_.now();
    return std::move(run_);
  }

 private:
  void advance(Instant until) {
    while (timeline_.step(until)) {
    }
  }

  // What an event has changed, and whether that is allowed.
  void look_at(const Touch& touch) {
    if (const auto touched = touch.who != 0 ? network_.find(touch.who) : nullptr) {
      run_.steps.mix(touched->forest().structure_version());
      run_.steps.mix(touched->directory().latest_lamport_time());
      run_.steps.mix(touched->member().presence().incarnation + touched->open_calls());
      invariants_.after(*touched);
    }
    invariants_.after(timeline_.now());
  }

  void note(const std::string& step) {
    run_.steps.mix(step);
    if (trace_)
      std::printf("%12.3f ms  %s\n",
                  std::chrono::duration<double, std::milli>(timeline_.now()).count(), step.c_str());
  }

  void violation(const std::string& kind, const std::string& what) {
    note("VIOLATION: " + kind + ": " + what);
    if (run_.failures.size() >= kMostFailures) return;
    run_.failures.push_back({kind,
                             std::to_string(timeline_.now().count() / 1'000'000) + " ms: " + what,
                             timeline_.now()});
  }

  [[nodiscard]] std::shared_ptr<Process> serving(const std::string& partition) const {
    Process* const daemon = cast_.find_daemon(partition);
    const bool runs =
        daemon != nullptr && daemon->serves() && !daemon->paused() && !daemon->ended();
    return runs ? daemon->shared_from_this() : nullptr;
  }

  // How many frames anybody has tried to add, including those of the configurations.
  [[nodiscard]] std::size_t frames_named() const {
    std::size_t named = 2 + 3 * plan_.owners + kContested + 2 * plan_.clients;
    for (const auto& actor : cast_.actors) named += actor->added();
    return named;
  }

  void forget_who_is_lost() {
    for (std::size_t i = 0; i < plan_.owners; ++i) {
      if (cast_.standings[i] != Cast::Standing::kOut) continue;
      run_.counts["somebody forgets who is lost"] += 1;
      return cast_.authors.front()->forget(cast_.name_of_daemon(i));
    }
  }

  std::shared_ptr<Process> start_client() {
    Process::Setting setting;
    setting.host = plan_.owners + clients_++;
    setting.id = daemons_.next_process();
    setting.clock = &clocks_[setting.host];
    auto process = std::make_shared<Process>(surroundings_, setting);
    network_.join(process);
    process->start();
    return process;
  }

  template <class One, class... Numbers>
  std::shared_ptr<One> start(Numbers... numbers) {
    auto one = std::make_shared<One>(start_client(), numbers..., cast_.actors.size(), cast_.wild);
    cast_.actors.push_back(one);
    one->start();
    return one;
  }

  void start_streamer() {
    cast_.streamers.push_back(std::make_shared<Streamer>(start_client()));
    cast_.streamers.back()->start();
  }

  void lost_power(const std::string& partition, Instant first) {
    for (const auto& author : cast_.authors) author->lost_power(partition, first);
    for (const auto& follower : cast_.followers) follower->lost_power(partition);
  }

  const Plan& plan_;
  const bool trace_;
  Timeline timeline_;
  Network network_;
  testing::Random random_;
  Invariants invariants_;
  Run run_;
  Surroundings surroundings_;
  Cast cast_;
  std::vector<Clock> clocks_;  // by computer
  Daemons daemons_;
  std::size_t clients_ = 0;
};

}  // namespace

Run run(const Plan& plan, bool trace) { return World(plan, trace).run(); }

}  // namespace tfdude::simulation
