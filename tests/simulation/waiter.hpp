#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "calls/waiting_lookup.hpp"
#include "simulation/planned.hpp"
#include "simulation/process.hpp"

namespace tfdude::simulation {

/// A client whose lookups wait, across deaths and returns of owners, until there is an answer or
/// their time is over. It attends to them as PendingLookups does: when the structure or the set of
/// reachable partitions has changed, when replies have come, and when they say. It also removes the
/// frame that a deputy has taken over.
class Waiter final : public Planned,
                     private LookupHost,
                     private ReplyListener,
                     private RequestLink,
                     public std::enable_shared_from_this<Waiter> {
 public:
  /// @param actor  the number by which its operations are counted
  Waiter(std::shared_ptr<Process> process, std::size_t actor);

  /// Goes on until stop(); a lookup that waits then goes on waiting.
  void start();
  void stop() { stopped_ = true; }

  [[nodiscard]] Process& process() { return *process_; }
  [[nodiscard]] const std::map<std::string, std::size_t>& outcomes() const { return outcomes_; }

 private:
  void next();
  void step();
  [[nodiscard]] bool may_remove() const;
  void remove();
  void wait(Error last);
  void attend(bool written);
  void end(const Result<StampedTransform>& X_WB);
  [[nodiscard]] Result<LookupPlan> route() const;
  [[nodiscard]] WantedLookup wanted() const { return {"world", frame_, {}}; }
  [[nodiscard]] TimeLimit::Clock::time_point now() const;

  // LookupHost
  [[nodiscard]] Result<LookupInProgress> plan(const WantedLookup& wanted) override;
  [[nodiscard]] bool was_pushed(const WantedLookup&) const override { return false; }
  [[nodiscard]] Error last_word(Error last, const TimeLimit&) override { return last; }
  [[nodiscard]] std::optional<Time> clock() const override { return process_->wall(); }

  void all_replied() override;

  // RequestLink
  [[nodiscard]] Result<void> send(const std::string& partition, const Request& request,
                                  TimeLimit::Clock::time_point until) override;
  [[nodiscard]] Reply answer(const Request& request) override { return process_->answer(request); }

  [[nodiscard]] std::string plan() const override;
  [[nodiscard]] bool hears(const Told& told) const override {
    return lookup_ != nullptr && (told.structure || told.routes);
  }
  [[nodiscard]] std::string name() const override { return "a lookup of " + frame_; }
  void renew() override;

  std::shared_ptr<Process> process_;
  const std::size_t actor_;
  testing::Random random_;  // of the current step
  std::size_t base_ = 0;    // whose frame is looked up
  std::string frame_;
  bool had_to_ = false;
  std::optional<TimeLimit> limit_;
  std::shared_ptr<WaitingLookup> lookup_;  // once it waits
  TimeLimit::Clock::time_point wakes_{};   // by the newest of its timers
  std::uint64_t told_ = 0;                 // how often something has changed
  std::set<std::uint32_t> sent_;           // the numbers of its requests
  std::size_t steps_ = 0;
  std::map<std::string, std::size_t> outcomes_;
  bool stopped_ = false;
};

}  // namespace tfdude::simulation
