#pragma once

#include <functional>
#include <string>

#include "simulation/invariants.hpp"

namespace tfdude::simulation {

/// Something that a process has planned and goes on using, such as a lookup that waits, or a
/// stream. Whatever changes the plan must tell that, since nobody looks again without being told.
class Planned {
 public:
  /// What an input has changed, as the process is told.
  struct Told {
    bool structure = false;  ///< the frames: lookups that wait hear of each commit
    bool routes = false;     ///< as of Outcome
  };

  virtual ~Planned() = default;

  /// An input was processed.
  void react(const Told& told, const Violation& violation) {
    std::string now = plan();
    if (hears(told)) {
      plan_ = std::move(now);
      renew();
    } else if (now != plan_) {
      violation("nobody is told of another plan", name() + ": " + plan_ + ", now " + now);
      plan_ = std::move(now);
    }
  }

 protected:
  /// From now on it has this plan.
  void begin() { plan_ = plan(); }

 private:
  /// The plan that it would have now, as a text.
  [[nodiscard]] virtual std::string plan() const = 0;
  [[nodiscard]] virtual bool hears(const Told& told) const = 0;
  [[nodiscard]] virtual std::string name() const = 0;
  /// Plans again.
  virtual void renew() = 0;

  std::string plan_;
};

}  // namespace tfdude::simulation
