#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>

#include "simulation/planned.hpp"
#include "simulation/process.hpp"

namespace tfdude::simulation {

/// A client whose lookups wait, across deaths and returns of owners, until there is an answer or
/// their time is over. As PendingLookups does, it looks again when the structure, or the set of
/// reachable partitions, has changed; and regularly only at what it can be asked for again. It also
/// removes the frame that a deputy has taken over.
class Waiter : public Planned, public std::enable_shared_from_this<Waiter> {
 public:
  /// @param actor  the number by which its operations are counted
  Waiter(std::shared_ptr<Process> process, std::size_t actor);

  /// Goes on until stop(); a lookup that waits then goes on waiting.
  void start();
  void stop() { stopped_ = true; }
  /// There must be no lookup that waits although it has an answer.
  void check();

  [[nodiscard]] Process& process() { return *process_; }
  [[nodiscard]] const std::map<std::string, std::size_t>& outcomes() const { return outcomes_; }

 private:
  void next();
  void step();
  [[nodiscard]] bool may_remove() const;
  void remove();
  void attempt();
  void attempted(const Result<StampedTransform>& X_WB);
  void finish(const std::string& how);
  [[nodiscard]] Result<LookupPlan> route() const;

  [[nodiscard]] std::string plan() const override;
  [[nodiscard]] bool hears(const Told& told) const override {
    return waits_ && (told.structure || told.routes);
  }
  [[nodiscard]] std::string name() const override { return "a lookup of " + frame_; }
  void renew() override;

  std::shared_ptr<Process> process_;
  const std::size_t actor_;
  testing::Random random_;  // of the current step
  std::size_t base_ = 0;    // whose frame is looked up
  std::string frame_;
  Instant until_{};
  bool waits_ = false;   // for the first attempt, or a later one
  bool asks_ = false;    // an attempt is under way
  bool again_ = false;   // something has changed meanwhile
  bool had_to_ = false;  // the first attempt has failed
  std::size_t steps_ = 0;
  std::map<std::string, std::size_t> outcomes_;
  bool stopped_ = false;
};

}  // namespace tfdude::simulation
