#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/types/partition_info.hpp"
#include "tfdude/types/query.hpp"

#include "base/loop.hpp"
#include "base/mutex.hpp"
#include "partition/routing.hpp"
#include "runtime/context.hpp"
#include "runtime/member_runner.hpp"
#include "runtime/memory_waits.hpp"
#include "runtime/process_memory.hpp"
#include "tree/forest.hpp"
#include "tree/remote_edges.hpp"

namespace tfdude {

/// Lookups in the memory of owners on this computer, and the offer of the own memory to others.
///
/// An owner whose frames were looked up over DDS is asked where its memory is, by a thread in the
/// background. From then on lookups read it, as long as this process counts the owner as reachable.
/// Whatever they cannot answer from memory goes over DDS, with all its errors.
/// @par Thread safety  All functions are thread-safe. Lookups take no lock, except to bind edges of
///   a path that is new or has changed.
class MemoryReads {
 public:
  /// What is told to those who watch paths by it, from threads in the background.
  struct Watchers {
    /// The memory of an owner can be read from now on.
    std::function<void()> attached;
    /// Owners have committed something. @return when to call again, unless they have before
    Loop::Job::Run committed;
  };

  MemoryReads(const Context& context, ProcessMemory& memory, Watchers watchers);
  ~MemoryReads() { stop(); }
  MemoryReads(const MemoryReads&) = delete;
  MemoryReads& operator=(const MemoryReads&) = delete;

  /// After it has returned, nothing runs in the background, and the own memory is not offered.
  void stop();

  // --- reading

  /// X_AB, if all edges are own or can be read; otherwise an error that says nothing.
  template <class Name>
  [[nodiscard]] Result<Pose> lookup_pose(Name a, Name b) {
    return read(a, b, edges_, [&] { return structure_.forest.lookup_pose(a, b, edges_); });
  }
  template <class Name>
  [[nodiscard]] Result<StampedTransform> lookup(Name a, Name b, const Query& query) {
    // The age of an instant is a difference of two times, which must be of one clock.
    if (query.age_noise_until && other_clocks_.load(std::memory_order_relaxed)) {
      return fail(Errc::kUnsupported, {});
    }
    // Over DDS each owner adds up its edges first, which makes a difference for these. So does who
    // reads their segments in memory; see read(Request).
    if (query.order == Order::kFourth) return fail(Errc::kUnsupported, {});
    auto X_AB = read(a, b, edges_, [&] { return structure_.forest.lookup(a, b, query, edges_); });
    if (X_AB && X_AB->basis.bound) X_AB = fail(Errc::kUnsupported, {});
    return X_AB;
  }
  /// The reply of an owner to a request for segments, if it can be read.
  [[nodiscard]] std::optional<Reply> read(const Request& request);
  /// As lookup(); of owners that are gone or do not respond, the last values. The answer names
  /// them; if another process serves one of them meanwhile, there is none.
  [[nodiscard]] Result<StampedTransform> last_known(const std::string& a, const std::string& b,
                                                    const Query& query);
  /// Whether there is anything to read.
  [[nodiscard]] bool any() const { return edges_.any() && !member_.out(); }

  // --- watched paths

  /// Whether a path of these parts can be watched in memory. Otherwise it is found out where that
  /// is.
  [[nodiscard]] bool can_watch(const std::vector<Part>& parts);
  /// As lookup(); of owners that are gone, the last values.
  [[nodiscard]] Result<StampedTransform> lookup_kept(const std::string& a, const std::string& b,
                                                     const Query& query) {
    return read(a, b, kept_, [&] { return structure_.forest.lookup(a, b, query, kept_); });
  }
  /// As Forest::lookup_former(): while the path changes.
  [[nodiscard]] Result<StampedTransform> lookup_former(const std::string& a, const std::string& b) {
    const Forest& forest = structure_.forest;
    auto X_AB = forest.lookup_former(a, b, kept_);
    if (!X_AB && forest.bind(a, b, kept_, true) > 0) X_AB = forest.lookup_former(a, b, kept_);
    return X_AB;
  }
  /// As Forest::explain().
  [[nodiscard]] Error explained(Error error, const std::string& a, const std::string& b,
                                const Query& query) const {
    return structure_.forest.explain(std::move(error), a, b, query, kept_);
  }
  /// As Forest::written().
  [[nodiscard]] std::optional<std::uint64_t> written(const std::string& a, const std::string& b) {
    auto number = structure_.forest.written(a, b, kept_);
    if (!number && structure_.forest.bind(a, b, kept_) > 0) {
      number = structure_.forest.written(a, b, kept_);
    }
    return number;
  }
  /// Waits for commits of these owners, and no others.
  void wait_for(const std::set<Owner>& owners);

  // --- owners

  /// Owners were asked over DDS for parts of a lookup.
  void asked(const std::vector<Part>& parts);
  /// What a plan would find has changed.
  void look_again();
  /// Finds out where the memory of all reachable owners is, on this thread.
  void find_all();
  /// Says of each partition how its frames are looked up.
  void tell(std::vector<PartitionInfo>& partitions) const;

  // --- being read

  /// The reply to a MemoryRequest. @param incarnation  of the own partition
  [[nodiscard]] Reply answer(const Request& request, std::uint64_t incarnation);

 private:
  using Clock = Loop::Clock;

  struct Known {
    enum class State { kWanted, kAttached, kRefused };
    State state = State::kWanted;
    std::uint64_t incarnation = 0;
    std::string why_not;
    Clock::time_point since = Clock::now();
  };

  // An owner whose memory was attached, and the last commit of which is still read by `kept_`.
  struct Kept {
    std::uint64_t incarnation = 0;
    std::shared_ptr<const RemoteForest> forest;
    MappedMemory memory;
    std::optional<Clock::time_point> lost{};  // since when it is gone
  };

  template <class Name, class Look>
  [[nodiscard]] auto read(const Name& a, const Name& b, RemoteEdges& edges, Look look)
      -> decltype(look()) {
    auto X_AB = look();
    const bool unbound = !X_AB && X_AB.error().code == Errc::kNotOwner;
    if (unbound && structure_.forest.bind(a, b, edges) > 0) X_AB = look();
    return X_AB;
  }

  [[nodiscard]] Clock::time_point run();
  void attach_wanted();
  void attach(Owner owner) TFDUDE_REQUIRES(attaching_);
  [[nodiscard]] Result<MemoryOffer> offer_of(const std::string& partition);
  void renew();
  void note(Owner owner, std::optional<Known> known);
  void end(Owner owner, std::uint64_t incarnation, bool died);
  /// Forgets the last values of owners that have returned as another process, or have been gone
  /// for longer than most others.
  void drop_kept() TFDUDE_REQUIRES(mutex_) TFDUDE_REQUIRES(structure_.mutex);
  void set_waited(bool waited);

  Structure& structure_;
  MemberRunner& member_;
  Requests& requests_;
  ProcessMemory& memory_;
  const bool is_off_;
  const bool reads_;
  const Milliseconds timeout_;
  RemoteEdges edges_;  // of owners that are there
  RemoteEdges kept_;   // of those, and of some that are gone
  std::atomic<bool> other_clocks_{false};
  mutable Mutex mutex_{LockRank::kParts};
  std::map<Owner, Known> owners_ TFDUDE_GUARDED_BY(mutex_);
  std::map<Owner, Kept> memories_ TFDUDE_GUARDED_BY(mutex_);
  Mutex offer_mutex_{LockRank::kParts};
  std::optional<MemoryOffer> offer_ TFDUDE_GUARDED_BY(offer_mutex_);
  Mutex attaching_{LockRank::kSending};  // one owner after the other
  // Last: they use the other members.
  const Watchers watchers_;
  Loop::Job job_;
  Loop::Job wake_job_;  // wakes those who wait for own commits
  MemoryWaits waits_;
};

}  // namespace tfdude
