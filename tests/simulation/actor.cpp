#include "simulation/actor.hpp"

#include <chrono>
#include <utility>

namespace tfdude::simulation {

Actor::Actor(std::shared_ptr<Process> process, const char* kind, std::size_t number,
             std::size_t owners, Instant pause)
    : process_(std::move(process)),
      owners_(owners),
      random_(0),
      kind_(kind),
      number_(number),
      pause_(pause) {}

// Each operation has random numbers of its own, so that leaving one out changes no other.
void Actor::next() {
  if (stopped_) return;
  random_ = testing::Random(process_->world().plan.seed_of(number_, ++steps_));
  const auto most = std::chrono::duration_cast<std::chrono::microseconds>(pause_);
  const Instant pause =
      std::chrono::microseconds(random_.index(static_cast<std::size_t>(most.count())));
  process_->later(kind_, pause + std::exchange(rest_, Instant(0)),
                  [this, self = shared_from_this()] {
                    if (stopped_) return;
                    Surroundings& world = process_->world();
                    if (world.plan.leaves_out(number_, steps_)) return next();
                    world.did(number_, steps_);
                    step();
                  });
}

void Actor::begin(const std::string& what, const std::shared_ptr<Task>& task, Then then) {
  process_->begin(
      what, task,
      [this, self = shared_from_this(), what, then = std::move(then)](const Result<void>& outcome) {
        const std::string code = outcome ? "done" : std::string(to_string(outcome.error().code));
        process_->world().trace(title() + ": " + what + ": " + code);
        ++outcomes_[std::string(kind_) + ": " + what.substr(0, what.find(' ')) + " " + code];
        then(outcome);
      });
}

}  // namespace tfdude::simulation
