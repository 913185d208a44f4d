#pragma once

#include <functional>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "simulation/cast.hpp"
#include "simulation/invariants.hpp"
#include "simulation/plan.hpp"

namespace tfdude::simulation {

/// How long after the faults somebody forgets who does not return.
inline constexpr Instant kForgetAfter = milliseconds(4000);

/// Checks what must be true after the remaining participants have had time to agree.
class Verdict {
 public:
  struct Calls {
    Violation violation;
    std::function<void(const std::string&, std::size_t)> count;
    std::function<void(Instant)> wait;
  };

  /// @param named  how many frames anybody has tried to add
  Verdict(const Plan& plan, const Cast& cast, std::size_t named, Calls calls)
      : plan_(plan), cast_(cast), named_(named), calls_(std::move(calls)) {}

  void check();

 private:
  void violation(const std::string& kind, const std::string& what);
  [[nodiscard]] std::vector<std::string> forgotten() const;
  [[nodiscard]] std::set<std::string> cannot_return() const;
  [[nodiscard]] bool cannot_withdraw(const std::string& frame, const std::string& owner) const;
  [[nodiscard]] std::vector<std::string> structure_of(const Process& one) const;
  [[nodiscard]] bool passes_over_one(Process& client) const;
  [[nodiscard]] bool lacks_one(Process& client) const;
  [[nodiscard]] bool is_told_by_one(const std::string& partition) const;
  [[nodiscard]] bool hears_all(Process& client) const;
  void check_replica(Process& one, const std::vector<std::string>& expected);
  /// Null: no daemon serves it, or it has a lasting fault.
  [[nodiscard]] Process* find_core(const std::string& partition) const;
  /// By a partition of the core.
  [[nodiscard]] bool is_held(const std::string& frame) const;
  void check_forgotten(Process& one, const std::string& partition);
  void check_follower(Follower& follower);
  void check_samplers();
  void check_owners(Process& one);
  void check_handed(Process& one);
  [[nodiscard]] bool is_left_over(const FrameInfo& frame, Process& seen_by) const;
  void check_author(Author& author);
  void look_up_all(Author& author);
  void await_calls();
  void check_kept(Process& one);
  void check_kept_by_owner(Process& owner);

  const Plan& plan_;
  const Cast& cast_;
  const std::size_t named_;
  const Calls calls_;
  bool agreed_ = true;
};

}  // namespace tfdude::simulation
