#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "partition/routing.hpp"
#include "simulation/timeline.hpp"

namespace tfdude::simulation {

class Process;

/// A reply, and the process that gave it.
struct Answer {
  Reply reply;
  std::uint64_t by = 0;
};

/// One call of a client in steps, as Requests makes it: it is planned, sent until it is answered,
/// planned again if the structure has changed meanwhile, and ends at its deadline at the latest.
class Operation : public std::enable_shared_from_this<Operation> {
 public:
  using Route = std::function<Result<std::vector<Part>>()>;
  using Then = std::function<void(const Result<void>&, const std::vector<Answer>&)>;

  static constexpr milliseconds kTimeout{1000};

  /// @param then  called once
  Operation(Process& caller, Route route, Then then);

  void start();
  void on_reply(std::uint64_t from, const Reply& reply);
  void on_lost(const std::string& partition);
  /// Something has changed for which it may wait.
  void look_again();
  [[nodiscard]] bool over() const { return over_; }
  /// Requests from here on are awaited.
  [[nodiscard]] std::uint32_t first_sequence() const;

 private:
  enum class Phase { kPlan, kAsk, kConfirm };

  void plan();
  void ask(std::vector<Part> parts);
  void send(Instant pause, int round);
  void take_if_answered();
  void answered();
  void retry(Instant pause);
  void await_change(Instant until, bool stale);
  void finish(Result<void> outcome);
  [[nodiscard]] Instant now() const;

  Process& caller_;
  const Route route_;
  Then then_;
  Instant deadline_{};
  Phase phase_ = Phase::kPlan;
  std::vector<Part> parts_;
  std::vector<std::optional<Answer>> answers_;
  Result<void> outcome_;
  int attempts_ = 0;
  int round_ = 0;  // of asking
  std::uint64_t version_ = 0;
  Instant pause_{milliseconds(5)};
  bool stored_ = true;
  bool over_ = false;
};

}  // namespace tfdude::simulation
