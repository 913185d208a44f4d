#pragma once

#include <chrono>
#include <functional>
#include <memory>

#include "tfdude/base/time.hpp"

#include "base/loop.hpp"

namespace tfdude {

/// Calls all user functions of a participant, from threads that hold no lock, so they may call any
/// function and take any time. The calls of one line run one after the other, in order. One thread
/// runs all lines in turn. Others help only if calls take long, so that no line waits for running
/// calls of others longer than kPatience, or kPatienceWithBusy if they are many short ones. Threads
/// that are not needed end.
/// @par Thread safety  All functions are thread-safe.
class Callbacks {
 public:
  using Clock = Loop::Clock;
  using Call = std::function<void()>;

  static constexpr Milliseconds kPatience{5};
  static constexpr Milliseconds kPatienceWithBusy{100};

  class Line;

  /// @param loop  looks after calls that wait; outlives this
  explicit Callbacks(Loop& loop);
  ~Callbacks() { stop(); }
  Callbacks(const Callbacks&) = delete;
  Callbacks& operator=(const Callbacks&) = delete;

  /// @param gather  how long a call may wait for others, so that many of them wake a thread once
  [[nodiscard]] std::shared_ptr<Line> line(Milliseconds gather = Milliseconds(0));

  /// Drops the calls of all lines that have not started. After it has returned none runs, except
  /// one that calls this, and then its thread ends with it.
  void stop();

 private:
  struct State;
  [[nodiscard]] Clock::time_point look_after();

  // Threads, and lines, may outlive this object.
  const std::shared_ptr<State> state_;
  Loop::Job look_;
};

/// Calls that run one after the other. A line may outlive its Callbacks, and then runs nothing.
/// @par Thread safety  All functions are thread-safe.
class Callbacks::Line : public std::enable_shared_from_this<Line> {
 public:
  Line(std::shared_ptr<State> state, Milliseconds gather);
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;
  ~Line();

  /// Runs it after the earlier ones. What it holds is destroyed before its end is reported.
  void post(Call call);
  /// As post(), but it waits for go().
  void prepare(Call call);
  void go();

  /// Another line of the same Callbacks, which may have ended.
  [[nodiscard]] std::shared_ptr<Line> another() const;

  /// Drops the calls that have not started. After it has returned none is running and none will
  /// run, except one that calls this.
  void close();
  [[nodiscard]] bool closed() const;

 private:
  friend class Callbacks;
  struct Waiting;

  const std::shared_ptr<State> state_;
  const Milliseconds gather_;
  const std::unique_ptr<Waiting> waiting_;  // under the state's lock
};

}  // namespace tfdude
