#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "calls/waiting_lookup.hpp"
#include "simulation/actor.hpp"
#include "simulation/planned.hpp"

namespace tfdude::simulation {

/// A client whose lookups wait, across deaths and returns of owners, until there is an answer or
/// their time is over. It attends to them as PendingLookups does: when the structure or the set of
/// reachable partitions has changed, when replies have come, and when they say. It also removes the
/// frame that a deputy has taken over.
class Waiter final : public Actor,
                     public Planned,
                     private LookupHost,
                     private ReplyListener,
                     private RequestLink {
 public:
  Waiter(std::shared_ptr<Process> process, std::size_t actor, std::size_t owners);

  /// Goes on until stop(); a lookup that waits then goes on waiting.
  void start() override;

 private:
  void step() override;
  [[nodiscard]] std::string title() const override { return name(); }
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

  std::size_t base_ = 0;  // whose frame is looked up
  std::string frame_;
  bool had_to_ = false;
  std::optional<TimeLimit> limit_;
  std::shared_ptr<WaitingLookup> lookup_;  // once it waits
  TimeLimit::Clock::time_point wakes_{};   // by the newest of its timers
  std::uint64_t told_ = 0;                 // how often something has changed
  std::set<std::uint32_t> sent_;           // the numbers of its requests
};

}  // namespace tfdude::simulation
