#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "simulation/process.hpp"

namespace tfdude::simulation {

/// A client that makes one operation after the other, and knows the possible results.
class Actor : public std::enable_shared_from_this<Actor> {
 public:
  Actor(const Actor&) = delete;
  Actor& operator=(const Actor&) = delete;
  virtual ~Actor() = default;

  /// Goes on until stop().
  virtual void start() { next(); }
  void stop() { stopped_ = true; }

  [[nodiscard]] Process& process() { return *process_; }
  [[nodiscard]] const std::map<std::string, std::size_t>& outcomes() const { return outcomes_; }
  /// How many frames of its own it has tried to add.
  [[nodiscard]] virtual std::size_t added() const { return 0; }

 protected:
  using Then = RunningCall::Then;

  /// @param kind  for people; a literal
  /// @param number  by which its operations are counted
  /// @param owners  whose partitions it uses; none of them is renamed
  /// @param pause  at most, before an operation
  Actor(std::shared_ptr<Process> process, const char* kind, std::size_t number, std::size_t owners,
        Instant pause);

  /// Plans the next operation.
  void next();
  /// Makes an operation; next() must follow.
  virtual void step() = 0;
  /// What it works with, for people.
  [[nodiscard]] virtual std::string title() const = 0;
  /// Makes a call, and counts its outcome.
  void begin(const std::string& what, const std::shared_ptr<Task>& task, Then then);

  const std::shared_ptr<Process> process_;
  const std::size_t owners_;
  testing::Random random_;  // of the current operation
  Instant rest_{};          // before the next one, besides the pause
  std::map<std::string, std::size_t> outcomes_;

 private:
  const char* const kind_;
  const std::size_t number_;
  const Instant pause_;
  std::size_t steps_ = 0;
  bool stopped_ = false;
};

}  // namespace tfdude::simulation
