#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "calls/call.hpp"

namespace tfdude {

/// Hands a frame, with all below it that its owner reaches through own frames, over to another
/// partition. Reads what the owner knows of the frames, part by part, and passes each part on to
/// the new owner, which takes them with the last one; then waits until the former owner has let go.
/// Whatever fails before that, the former owner is told to keep them.
class HandOverTask final : public Task {
 public:
  /// @param parent  the new parent; absent: it stays where it is, and X_PC is empty
  /// @param until  the end of the call
  HandOverTask(const Forest& forest, std::string id, std::string to,
               std::optional<std::string> parent, PartialTransform X_PC, Clock::time_point until)
      : forest_(forest),
        id_(std::move(id)),
        to_(std::move(to)),
        parent_(std::move(parent)),
        X_PC_(std::move(X_PC)),
        until_(until) {}

  [[nodiscard]] std::vector<std::string> frames() const override;
  /// @return kUnknownFrame, kUnknownPartition, kUnknownParent, kCycle, kUnreachable, kInvalidInput
  [[nodiscard]] Result<void> plan(const Directory& directory, Clock::time_point now) override;
  [[nodiscard]] std::vector<Part>& parts() override { return parts_; }
  [[nodiscard]] bool changes() const override { return true; }
  [[nodiscard]] Result<Next> take(std::vector<Reply> replies, Clock::time_point now) override;
  [[nodiscard]] Milliseconds pause() const override { return pause_; }
  /// Once it is done: the frame belonged to the new owner before, so that it is where it was.
  [[nodiscard]] bool had_it() const { return had_it_; }

 private:
  enum class State : std::uint8_t { kConfirm, kBegin, kRead, kGive, kEnd, kCancel };
  using Step = HandOverRequest::Step;

  [[nodiscard]] Result<void> check_parent() const;
  void ask_owner(State state, HandOverRequest body);
  [[nodiscard]] Result<Next> give(HandedPart part);
  [[nodiscard]] Result<Next> cancel(Error why);
  [[nodiscard]] bool waits(const Error* error, Clock::time_point now) const;

  const Forest& forest_;
  const std::string id_;
  const std::string to_;
  const std::optional<std::string> parent_;
  const PartialTransform X_PC_;
  const Clock::time_point until_;
  static constexpr Milliseconds kShortest{2};
  static constexpr Milliseconds kLongest{50};

  State state_ = State::kBegin;
  Milliseconds pause_ = kShortest;  // before the same question
  Part owner_;                      // the route to it
  Part new_owner_;                  // likewise
  std::vector<Part> parts_;
  LamportTime lamport_time_ = 0;
  HandOverRequest next_;  // to read
  bool is_last_ = false;  // the part that was given
  bool had_it_ = false;
  Error why_;  // it is cancelled
};

}  // namespace tfdude
