#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <limits>
#include <list>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tfdude/types/options.hpp"

#include "base/mutex.hpp"
#include "runtime/callbacks.hpp"
#include "runtime/watch_mirror.hpp"
#include "runtime/watched.hpp"

namespace tfdude {

class MemoryReads;

/// Whether a lookup has found again what another one had found.
[[nodiscard]] inline bool is_same_value(const StampedTransform& one,
                                        const StampedTransform& other) {
  return one.stamp == other.stamp && one.covariance == other.covariance &&
         one.pose.translation() == other.pose.translation() &&
         one.pose.rotation().coeffs() == other.pose.rotation().coeffs();
}

/// One watched path, or several edges that are watched together. If the memory of all owners of the
/// path can be read, it is read there. Otherwise it shows the mirror of one route,
/// which readers find by one load. If the path takes another route, that has its own mirror, which
/// is shown once it has all values; readers of the previous one keep it until they are done
/// (epoch.hpp). While the shown mirror has no instant
/// that all its edges have, its last transform is shown instead.
class WatchedPath final : public Watched, public std::enable_shared_from_this<WatchedPath> {
 public:
  using Listener = std::function<void()>;
  using ValueCallback = std::function<void(const Result<StampedTransform>&)>;

  /// @param routes  calls WatchOptions::on_route; null: nothing is called, on_value() neither
  /// @param memory  of others, as long as end() was not called; null: all push
  WatchedPath(std::string a, std::string b, WatchOptions options,
              std::shared_ptr<Callbacks::Line> routes = nullptr, MemoryReads* memory = nullptr);
  /// The edges of these frames. lookup(Query) then has no result, and there is no common instant to
  /// wait for.
  WatchedPath(std::vector<std::string> frames, WatchOptions options,
              std::shared_ptr<Callbacks::Line> routes = nullptr);
  ~WatchedPath() override;
  WatchedPath(const WatchedPath&) = delete;
  WatchedPath& operator=(const WatchedPath&) = delete;

  // --- from any thread ---

  /// No lock or allocation, except while the path is not followed, and at the moment when its edges
  /// lose or regain their common instant.
  [[nodiscard]] Result<StampedTransform> lookup(const Query& query) const;
  /// Between two frames at the ends of watched edges. Without a lock, except while the edges are
  /// not followed.
  [[nodiscard]] Result<StampedTransform> lookup(std::string_view a, std::string_view b,
                                                const Query& query) const;

  /// See EdgesWatch::stamps().
  [[nodiscard]] std::vector<Time> stamps(std::string_view id, Time after) const;

  [[nodiscard]] Result<void> health() const;
  [[nodiscard]] std::uint64_t messages() const { return messages_.load(std::memory_order_relaxed); }
  /// What there is to hear of: the numbers of messages, and of ends of the path.
  struct Heard {
    std::uint64_t messages = 0;
    std::uint64_t ends = 0;
  };
  [[nodiscard]] Heard heard() const { return {messages(), ends_.load(std::memory_order_relaxed)}; }
  /// @return false at the deadline, or if the client ends
  [[nodiscard]] bool wait_for_more(std::uint64_t messages, Clock::time_point deadline) const;
  /// As wait_for_more(), but also returns if the path ends.
  [[nodiscard]] bool wait_for_news(const Heard& before, Clock::time_point deadline) const;
  /// Why nothing is waited for any more; nothing while the client has not ended.
  [[nodiscard]] std::optional<Error> ended() const;
  /// See PathWatch::on_news(). @return keeps the listener; it may outlive this object
  [[nodiscard]] std::shared_ptr<void> on_news(Listener listener);
  /// See PathWatch::on_value(). @return ends it
  [[nodiscard]] std::shared_ptr<void> on_value(ValueCallback callback);
  /// Nobody watches it any more: no function of the user is called from now on, except one whose
  /// call has begun. It is followed until the next round.
  void leave() { left_ = true; }
  /// Waits until the path is followed and its dynamic edges have a common instant; lack of the
  /// latter is no error.
  /// @return why it is not followed, at the deadline
  [[nodiscard]] Result<void> wait_until_live(Clock::time_point deadline) const;

  [[nodiscard]] const std::string& a() const { return a_; }
  [[nodiscard]] const std::string& b() const { return b_; }
  [[nodiscard]] const WatchOptions& options() const { return options_; }
  /// For messages: "path from 'a' to 'b'".
  [[nodiscard]] std::string described() const;
  /// The current route. @return as Client::lookup()
  [[nodiscard]] Result<WatchRoute> route(const KnownStructure& known) const;

  bool take(const PushedValues& pushed, Clock::time_point now) override;
  void end_waits() override;
  /// After it has returned, no memory of others is read.
  void end() override;
  [[nodiscard]] std::shared_ptr<Callbacks::Line> calls_on() const override {
    return options_.on_route ? routes_ : nullptr;
  }
  Looked look(Clock::time_point now) override;
  [[nodiscard]] std::set<Owner> owners_in_memory() const override;
  [[nodiscard]] bool can_answer(const std::string& a, const std::string& b,
                                const Query& query) const override {
    return a_ == a && b_ == b && has_data(query);
  }

  // --- for the rounds, from one thread ---

  [[nodiscard]] std::vector<std::string> frames() const override;
  [[nodiscard]] Result<void> plan(const KnownStructure& known) override;
  [[nodiscard]] Plan adopt(Clock::time_point now) override;
  bool on_no_plan(Error why, Clock::time_point now) override;
  bool on_deaf(Error why) override;
  bool on_denied(const Part& part, const Error* why) override;
  /// An owner that has returned has to send its values first: until then old ones are shown.
  void on_complete() override { set_health({}); }
  [[nodiscard]] bool lacks(Clock::time_point /*now*/) const override { return !up_to_date(); }
  [[nodiscard]] std::optional<Time> lacks_from() override;
  [[nodiscard]] std::optional<Time> lacks_earlier() override { return lacks_from(); }
  void on_told_from(Time from, Clock::time_point now) override;
  [[nodiscard]] std::set<std::uint64_t> groups(Clock::time_point now) override;
  [[nodiscard]] unsigned periods() const override { return 1; }

 private:
  struct Values;
  struct Listeners {
    Mutex mutex;
    std::list<Listener> all TFDUDE_GUARDED_BY(mutex);
    std::list<std::shared_ptr<Values>> values TFDUDE_GUARDED_BY(mutex);
  };
  struct Retired {
    std::uint64_t tag;
    std::shared_ptr<const void> object;
  };

  [[nodiscard]] bool live() const {
    return shown_.load(std::memory_order_acquire) != nullptr || in_memory();
  }
  [[nodiscard]] bool in_memory() const {
    return memory_.load(std::memory_order_acquire) != nullptr;
  }
  /// Whether the last transform may be returned for this query, once there is no newer one.
  [[nodiscard]] static bool wants_newest(const Query& query) {
    return !query.at && !query.age_noise_until && query.order == Order::kSecond &&
           !query.believed_at;
  }
  /// What is found in the memory of the owners, or was there last.
  [[nodiscard]] Result<StampedTransform> lookup_in(MemoryReads& memory, const Query& query) const;
  void note_read(std::int64_t stamp) const;
  /// Whether the memory of all owners of the route is known.
  [[nodiscard]] bool reads_all(MemoryReads& memory) const;
  /// The last transform, if nobody has read a later one.
  [[nodiscard]] std::optional<StampedTransform> shown_before() const;
  void explain(const MemoryReads& memory, const Query& query, Error& why) const;
  /// From now on the planned route is read in memory. @return whether another one was shown before
  bool read_memory(Clock::time_point now);
  /// Whether the path uses this route, or is about to.
  [[nodiscard]] bool follows(const WatchRoute& route) const;
  /// Prepares another route. @return whether it is shown already, as it needs no values
  bool prepare(WatchRoute route, Clock::time_point now);
  /// Whether the route is shown with all values of its owners, as far as they are available.
  [[nodiscard]] bool up_to_date() const;
  /// Sets the reason why there is no answer for now.
  void interrupt(Error why);
  /// Whether the error means that the path no longer exists. The news of a move may come before
  /// that of its destination.
  [[nodiscard]] bool is_gone(const Error& error, Clock::time_point now);
  /// The path exists: is_gone() begins to count again.
  void planned();
  /// Frees mirrors that have no readers any more.
  void collect();
  /// Whether the pushed values suffice for this query.
  [[nodiscard]] bool has_data(const Query& query) const;
  /// The mirror that takes values: of the next route, if there is one. Null: there is none.
  [[nodiscard]] WatchMirror* latest() const TFDUDE_REQUIRES(mutex_) {
    return next_ != nullptr ? next_.get() : followed_.get();
  }
  [[nodiscard]] std::optional<Time> skipped_from() const TFDUDE_REQUIRES(mutex_);
  /// See WatchMirror::lacks_history(); returned a few times only, as no owner may have the samples.
  [[nodiscard]] std::optional<Time> lacks_history() TFDUDE_REQUIRES(mutex_);
  /// Sets whether all owners are reachable, and have sent their values since.
  void set_health(Result<void> health);
  void report(std::string what);
  void report_rerouted();
  [[nodiscard]] bool is_behind_memory(const Result<StampedTransform>& told) const
      TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] bool swap_if_ready(Clock::time_point now) TFDUDE_REQUIRES(mutex_);
  /// Null: nothing, unless it is read in memory.
  void show(std::unique_ptr<WatchMirror> mirror) TFDUDE_REQUIRES(mutex_);
  /// Tells all who wait that something is new.
  void tell();
  /// Call after any change of the shown values.
  void remember_newest() TFDUDE_REQUIRES(mutex_);
  void remember(Result<StampedTransform> newest) TFDUDE_REQUIRES(mutex_);
  void forget_newest() TFDUDE_REQUIRES(mutex_);
  void hold(std::unique_ptr<const StampedTransform> X) TFDUDE_REQUIRES(mutex_);

  const std::string a_;
  const std::string b_;
  const std::vector<std::string> frames_;  // instead of a path
  const WatchOptions options_;
  const std::shared_ptr<Callbacks::Line> routes_;
  std::atomic<const WatchMirror*> shown_{nullptr};      // followed_, for readers
  std::atomic<const StampedTransform*> held_{nullptr};  // holder_, for readers
  std::atomic<std::uint64_t> messages_{0};
  std::atomic<bool> left_{false};
  std::atomic<std::uint64_t> ends_{0};  // how often it had no answer any more
  // The latest instant [ns] that was read in memory: what is shown instead is not older.
  mutable std::atomic<std::int64_t> latest_read_{std::numeric_limits<std::int64_t>::min()};
  const std::shared_ptr<Listeners> listeners_ = std::make_shared<Listeners>();
  MemoryReads* const others_;                    // null: all push
  std::atomic<MemoryReads*> memory_{nullptr};    // instead of a mirror
  WatchRoute planned_;                           // until it is adopted; belongs to the rounds
  bool planned_in_memory_ = false;               // likewise
  mutable Condition changed_;                    // of messages_, ends_, shown_, ended_
  mutable Mutex mutex_{LockRank::kWatchedPath};  // guards the following members
  std::unique_ptr<WatchMirror> followed_ TFDUDE_GUARDED_BY(mutex_);
  std::unique_ptr<WatchMirror> next_ TFDUDE_GUARDED_BY(mutex_);  // shown once it has all values
  Clock::time_point next_since_ TFDUDE_GUARDED_BY(mutex_);
  std::optional<StampedTransform> newest_
      TFDUDE_GUARDED_BY(mutex_);  // the last one, of all mirrors
  std::unique_ptr<const StampedTransform> holder_ TFDUDE_GUARDED_BY(mutex_);
  int asked_for_history_ TFDUDE_GUARDED_BY(mutex_) = 0;
  bool was_shown_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::vector<Retired> retired_ TFDUDE_GUARDED_BY(mutex_);
  std::optional<WatchRoute> route_in_memory_ TFDUDE_GUARDED_BY(mutex_);
  std::optional<std::uint64_t> written_ TFDUDE_GUARDED_BY(mutex_);  // see MemoryReads::written()
  Clock::time_point tell_from_ TFDUDE_GUARDED_BY(mutex_) = Clock::time_point::min();
  std::optional<Clock::time_point> not_connected_since_ TFDUDE_GUARDED_BY(mutex_);
  Error why_not_ TFDUDE_GUARDED_BY(mutex_);
  bool ended_ TFDUDE_GUARDED_BY(mutex_) = false;
  Result<void> health_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude
