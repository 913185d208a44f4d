#pragma once

#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tfdude/math/transform.hpp"
#include "tfdude/types/query.hpp"

#include "runtime/discovery.hpp"
#include "runtime/memory_reads.hpp"
#include "runtime/pending_lookups.hpp"
#include "runtime/requests.hpp"
#include "runtime/structure.hpp"
#include "runtime/watch_client.hpp"

namespace tfdude {

/// Computes the pose of one frame in another, from local data or else from the owners' answers.
/// Client describes the return values.
/// @par Thread safety  All functions are thread-safe; local data is read without a lock.
class Lookups final : private LookupHost {
 public:
  /// @param watches  of values that others push
  /// @param memory  null: all others are asked
  Lookups(const Context& context, const WatchClient& watches, MemoryReads* memory = nullptr);

  /// Ends all waiting lookups and callbacks: as PendingLookups::stop().
  void stop() { pending_.stop(); }

  // Each returns one object, so that no answer is copied. The clock is read only if others have to
  // be asked.
  template <class Name>
  [[nodiscard]] Result<Pose> lookup_pose(Name a, Name b) {
    auto X_AB = here([&](auto& from) { return from.lookup_pose(a, b); });
    if (!X_AB) X_AB = lookup(a, b, {}).map([](const Transform& found) { return found.pose; });
    return X_AB;
  }
  template <class Name>
  [[nodiscard]] Result<StampedTransform> lookup(Name a, Name b, const Query& query) {
    auto X_AB = here([&](auto& from) { return from.lookup(a, b, query); });
    if (!X_AB && !is_of_time(X_AB.error())) {
      X_AB = elsewhere(a, b, query, discovery_.call_deadline());
    }
    return X_AB;
  }
  template <class Name>
  [[nodiscard]] Result<StampedTransform> lookup(Name a, Name b, const Query& query,
                                                const Deadline& deadline) {
    auto X_AB = here([&](auto& from) { return from.lookup(a, b, query); });
    if (!X_AB && !is_of_time(X_AB.error())) X_AB = elsewhere(a, b, query, deadline);
    return X_AB;
  }
  /// From the memory of this process or of others only, and so without waiting for anybody.
  /// @return the forest's error if the owners have to be asked
  [[nodiscard]] Result<StampedTransform> read(Handle a, Handle b, const Query& query) {
    return here([&](auto& from) { return from.lookup(a, b, query); });
  }
  [[nodiscard]] Result<StampedTransform> wait(std::string_view a, std::string_view b,
                                              const Query& query, Milliseconds wait);
  /// @return a handle; the lookup is cancelled when its last copy is destroyed
  [[nodiscard]] std::shared_ptr<void> start(const std::string& a, const std::string& b,
                                            const Query& query, Milliseconds wait,
                                            PendingLookups::Callback callback);
  [[nodiscard]] std::future<Result<StampedTransform>> start(const std::string& a,
                                                            const std::string& b,
                                                            const Query& query, Milliseconds wait);

  /// Owners have answered these: the memory of those on this computer is read from now on.
  void asked(const std::vector<Part>& parts) override {
    if (memory_ != nullptr) memory_->asked(parts);
  }

  /// Whether data for the instant is missing, and nothing else.
  static bool is_of_time(const Error& error) {
    return error.code == Errc::kNotYet || error.code == Errc::kTooOld;
  }

  /// As PendingLookups::pause().
  [[nodiscard]] bool pause(Deadline::Clock::time_point until) { return pending_.pause(until); }

  /// What a plan would find has changed.
  void look_again() { pending_.look_again(); }
  /// Others have pushed values.
  void pushed() { pending_.pushed(); }

 private:
  template <class... Callback>
  auto begin(const std::string& a, const std::string& b, const Query& query, Milliseconds wait,
             Callback... callback);

  // LookupHost
  [[nodiscard]] Result<LookupInProgress> plan(const WantedLookup& wanted) override;
  [[nodiscard]] bool asks_for_frames() const override { return requests_.on_demand() != nullptr; }
  [[nodiscard]] bool knows_all() override { return discovery_.complete(); }
  [[nodiscard]] bool was_pushed(const WantedLookup& wanted) const override {
    return watches_.can_answer(wanted.a, wanted.b, wanted.query);
  }
  [[nodiscard]] Error last_word(Error last, const TimeLimit& limit) override {
    return requests_.last_word(std::move(last), limit);
  }
  [[nodiscard]] std::optional<Time> clock() const override { return structure_.clock.now(); }

  /// What `look` finds in the memory of this process and, if any is attached, of others. The
  /// error is the forest's.
  template <class Look>
  [[nodiscard]] auto here(Look look) -> decltype(look(std::declval<const Forest&>())) {
    const Forest& own = structure_.forest;
    const bool reads = memory_ != nullptr && memory_->any();
    auto X_AB = reads ? look(*memory_) : look(own);
    if (reads && !X_AB) X_AB = look(own);
    return X_AB;
  }

  [[nodiscard]] Result<StampedTransform> elsewhere(std::string_view a, std::string_view b,
                                                   const Query& query, const Deadline& deadline);
  [[nodiscard]] Result<StampedTransform> elsewhere(Handle a, Handle b, const Query& query,
                                                   const Deadline& deadline);

  Structure& structure_;
  Discovery& discovery_;
  Requests& requests_;
  const WatchClient& watches_;
  MemoryReads* const memory_;
  const Milliseconds timeout_;
  SharedHints hints_;
  PendingLookups pending_;  // last: it uses the other members
};

}  // namespace tfdude
