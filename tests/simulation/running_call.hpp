#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "calls/tasks.hpp"
#include "simulation/timeline.hpp"

namespace tfdude::simulation {

class Process;

/// A call of a client: does what the library's Call says, as Requests does it on the thread of a
/// caller, but with events instead of waits.
class RunningCall : public std::enable_shared_from_this<RunningCall> {
 public:
  using Route = std::function<Result<std::vector<Part>>()>;
  using Then = std::function<void(const Result<void>&)>;

  static constexpr milliseconds kTimeout{1000};

  /// @param then  called once
  RunningCall(Process& caller, std::shared_ptr<Task> task, Then then);

  /// The task of a change.
  [[nodiscard]] static std::shared_ptr<Task> change(Route route);

  void start() { go_on(); }
  /// Something has come, or has changed.
  void go_on();
  [[nodiscard]] bool over() const { return call_.state() == Call::State::kOver; }

 private:
  /// @return whether there is more to do now
  [[nodiscard]] bool step();
  [[nodiscard]] bool ask();
  [[nodiscard]] bool store();
  [[nodiscard]] bool wait_until(TimeLimit::Clock::time_point until);
  void plan();
  void finish();
  [[nodiscard]] TimeLimit::Clock::time_point now() const;

  Process& caller_;
  const std::shared_ptr<Task> task_;
  Then then_;
  Call call_;
  TimeLimit::Clock::time_point wakes_{};    // by the newest of its timers
  TimeLimit::Clock::time_point planned_{};  // when it was planned last
  bool stores_ = false;                     // it waits for the disk
  bool steps_ = false;
};

}  // namespace tfdude::simulation
