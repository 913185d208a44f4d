#pragma once

#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "calls/call.hpp"

// The tasks of most calls. What a call asks for differs mainly in its route: a function that plans
// its requests with a directory.
namespace tfdude {

/// The first error in replies, but an error of storing before all others, whatever another attempt
/// may bring.
[[nodiscard]] Result<void> outcome_of(const std::vector<Reply>& replies);

/// The first error but kNotPermitted, which counts only if there is nothing else.
[[nodiscard]] Result<void> outcome_of_telling(std::vector<Reply> replies);

/// A task whose requests are planned by a function.
/// @tparam Route  returns a Part, or all of them, or the error
template <class Route>
class RoutedTask : public Task {
 public:
  explicit RoutedTask(Route route, std::vector<std::string> frames = {})
      : route_(std::move(route)), frames_(std::move(frames)) {}

  [[nodiscard]] std::vector<std::string> frames() const override { return frames_; }
  [[nodiscard]] Result<void> plan(const Directory& directory, Clock::time_point) override {
    auto planned = route_(directory);
    if (!planned) return tl::unexpected(std::move(planned.error()));
    if constexpr (std::is_same_v<std::decay_t<decltype(*planned)>, Part>) {
      parts_.clear();
      parts_.push_back(*std::move(planned));
    } else {
      parts_ = *std::move(planned);
    }
    return {};
  }
  [[nodiscard]] std::vector<Part>& parts() override { return parts_; }

 private:
  Route route_;
  const std::vector<std::string> frames_;
  std::vector<Part> parts_;
};

/// The values that owners have applied of a change that must be planned again as others have not: a
/// second sample of their stamp would be rejected.
class AppliedValues {
 public:
  void note(const std::vector<Part>& parts, const std::vector<Reply>& replies);
  /// Leaves out of a new plan what its owner has applied.
  void leave_out(std::vector<Part>& parts) const;

 private:
  // Edges or joints: no change has both.
  std::set<std::pair<Owner, std::string>> applied_;
};

/// A change of frames or values.
template <class Route>
class ChangeTask final : public RoutedTask<Route> {
 public:
  using RoutedTask<Route>::RoutedTask;

  [[nodiscard]] bool changes() const override { return true; }
  [[nodiscard]] Result<void> plan(const Directory& directory,
                                  Task::Clock::time_point now) override {
    auto planned = RoutedTask<Route>::plan(directory, now);
    if (planned) applied_.leave_out(this->parts());
    return planned;
  }
  [[nodiscard]] Result<Task::Next> take(std::vector<Reply> replies,
                                        Task::Clock::time_point) override {
    auto outcome = outcome_of(replies);
    if (!outcome) applied_.note(this->parts(), replies);
    return outcome.map([] { return Task::Next::kDone; });
  }

 private:
  AppliedValues applied_;
};

/// Tells owners something that each passes on: it is done once one of them has it. Those whom the
/// caller may not tell hear it from the others.
template <class Route>
class TellTask final : public RoutedTask<Route> {
 public:
  using RoutedTask<Route>::RoutedTask;

  [[nodiscard]] bool changes() const override { return true; }
  [[nodiscard]] Result<Task::Next> take(std::vector<Reply> replies,
                                        Task::Clock::time_point) override {
    return outcome_of_telling(replies).map([] { return Task::Next::kDone; });
  }
};

/// Asks one owner for data of one kind.
template <class Answer, class Route>
class AskTask final : public RoutedTask<Route> {
 public:
  using RoutedTask<Route>::RoutedTask;

  [[nodiscard]] Result<Task::Next> take(std::vector<Reply> replies,
                                        Task::Clock::time_point) override {
    auto& body = replies.front().body;
    if (auto* error = std::get_if<Error>(&body)) return tl::unexpected(std::move(*error));
    auto* answer = std::get_if<Answer>(&body);
    if (answer != nullptr) answer_ = std::move(*answer);
    return Task::Next::kDone;
  }
  /// Empty: it has answered something else.
  [[nodiscard]] std::optional<Answer>& answer() { return answer_; }

 private:
  std::optional<Answer> answer_;
};

/// Something that is known here, as soon as it is certain.
/// @tparam Find  takes a directory; returns a Result
template <class Find>
class FindTask final : public Task {
 public:
  using Found = std::invoke_result_t<Find, const Directory&>;

  FindTask(Find find, std::vector<std::string> frames, Milliseconds max_age)
      : find_(std::move(find)), frames_(std::move(frames)), max_age_(max_age) {}

  [[nodiscard]] std::vector<std::string> frames() const override { return frames_; }
  [[nodiscard]] Milliseconds max_age() const override { return max_age_; }
  [[nodiscard]] Result<void> plan(const Directory& directory, Clock::time_point) override {
    found_ = find_(directory);
    if (!found_) return tl::unexpected(found_.error());
    return {};
  }
  [[nodiscard]] std::vector<Part>& parts() override { return none_; }
  [[nodiscard]] Result<Next> take(std::vector<Reply>, Clock::time_point) override {
    return Next::kDone;
  }
  [[nodiscard]] Found& found() { return found_; }

 private:
  Find find_;
  const std::vector<std::string> frames_;
  const Milliseconds max_age_;
  Found found_ = tl::unexpected(Error());
  std::vector<Part> none_;
};

/// Finds out whether everything that reachable participants had changed when they were asked is
/// known here.
class CatchUpTask final : public Task {
 public:
  [[nodiscard]] Result<void> plan(const Directory& directory, Clock::time_point) override;
  [[nodiscard]] std::vector<Part>& parts() override { return parts_; }
  [[nodiscard]] bool changes() const override { return true; }
  [[nodiscard]] Result<Next> take(std::vector<Reply> replies, Clock::time_point) override;

  /// Once the call is over.
  [[nodiscard]] bool caught_up(const Directory& directory) const;

 private:
  std::vector<Part> parts_;
  std::vector<Reply> replies_;  // by part
};

}  // namespace tfdude
