#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/loop.hpp"
#include "base/mutex.hpp"
#include "runtime/context.hpp"
#include "runtime/open_groups.hpp"
#include "runtime/watched.hpp"

namespace tfdude {

/// What a participant watches, and the job that renews it at the owners periodically. So an owner
/// that has restarted learns of it, and lost values are sent again.
/// @par Thread safety  All functions are thread-safe, for callers that hold no lock.
class WatchLoop {
 public:
  explicit WatchLoop(const Context& context);
  ~WatchLoop() { stop(); }
  WatchLoop(const WatchLoop&) = delete;
  WatchLoop& operator=(const WatchLoop&) = delete;

  /// After it has returned nothing new comes, and what is watched reports so.
  void stop();

  /// Watched while it has another holder.
  void add(std::shared_ptr<Watched> watched);

  /// Applies pushed values.
  void on_pushed(const PushedValues& pushed);

  /// Whether pushed values suffice for this lookup.
  [[nodiscard]] bool can_answer(const std::string& a, const std::string& b,
                                const Query& query) const;

  /// What a plan would find has changed.
  void look_again();

 private:
  using Clock = Loop::Clock;
  struct Entry {
    explicit Entry(std::shared_ptr<Watched> one) : watched(std::move(one)) {}
    const std::shared_ptr<Watched> watched;
    std::atomic<bool> lacking{true};  // must be attended to soon
  };
  using Entries = std::vector<std::shared_ptr<Entry>>;
  enum class Answered { kAll, kPartly, kNotUntilRenewal };

  [[nodiscard]] Entries entries() const;
  /// Forgets what nobody needs any more. @return the others
  [[nodiscard]] Entries drop_unused();
  /// Attends to everything that needs it. @return when to do so again
  [[nodiscard]] Clock::time_point round();
  /// @return whether it is up to date; otherwise it must be retried soon
  [[nodiscard]] bool attend(Watched& watched, bool renew);
  /// Requests all values from the owners, or samples from an instant on.
  [[nodiscard]] Answered ask(Watched& watched, const std::vector<Watched::Group>& groups,
                             std::optional<Time> from);
  void close_unused(const Entries& all);

  const Context context_;
  mutable Mutex mutex_{LockRank::kParts};
  Entries entries_ TFDUDE_GUARDED_BY(mutex_);
  std::atomic<bool> watches_{false};  // or has watched before
  std::atomic<bool> replan_{false};
  std::atomic<Clock::time_point> last_round_{Clock::time_point::min()};
  // The following belong to the job.
  OpenGroups open_;
  Clock::time_point renew_at_ = Clock::time_point::min();
  std::uint64_t period_ = 0;
  Loop::Job rounds_;  // last: it uses the other members
};

}  // namespace tfdude
