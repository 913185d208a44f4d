#pragma once

#include <functional>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/mutex.hpp"
#include "calls/tasks.hpp"
#include "runtime/discovery.hpp"
#include "runtime/on_demand.hpp"
#include "runtime/structure.hpp"
#include "transport/port.hpp"

namespace tfdude {

/// This process as an owner, for its own requests.
class OwnPartition {
 public:
  virtual ~OwnPartition() = default;

  [[nodiscard]] virtual Reply answer_own(const Request& request) = 0;
  /// What another owner would reply, if it can be read in the memory of that owner.
  [[nodiscard]] virtual std::optional<Reply> read(const Request& /*request*/) {
    return std::nullopt;
  }
  /// Announces changes made here to others, which are asked to build on them.
  virtual void announce_changes(const Deadline& deadline) = 0;
  /// Waits until all changes made here are stored, if they are to be.
  [[nodiscard]] virtual Result<void> await_stored(const Deadline& deadline) = 0;
  /// @return kPartitionTaken if it has given up its partition.
  [[nodiscard]] virtual Result<void> check_owns_partition() = 0;
};

/// Makes calls to the owners of frames, including this process: does what they say (Call), on the
/// thread of their caller, and waits until there is more to do.
/// @par Thread safety  All functions are thread-safe, for callers that hold no lock.
class Requests final : public RequestLink {
 public:
  using Clock = Deadline::Clock;

  /// For a participant that does not keep all frames.
  struct Follow {
    std::vector<std::string> trees;   ///< as ClientOptions::follow
    std::function<void()> on_routes;  ///< as OnDemand::Links
  };

  /// @param follow  absent: the structure of all partitions is kept here
  Requests(Structure& structure, Discovery& discovery, Transport& transport, OwnPartition& own,
           std::optional<Follow> follow = {});

  /// The requests that wait for replies: for whoever receives these, and for waiting lookups.
  [[nodiscard]] ReplyTable& replies() { return replies_; }
  /// @return kPartitionTaken if this process has given up its partition.
  [[nodiscard]] Result<void> check_owns_partition() const { return own_.check_owns_partition(); }

  // RequestLink
  [[nodiscard]] Result<void> send(const std::string& partition, const Request& request,
                                  Clock::time_point until) override;
  [[nodiscard]] Reply answer(const Request& request) override { return own_.answer_own(request); }

  /// Null: all frames are kept here.
  [[nodiscard]] OnDemand* on_demand() const { return on_demand_.get(); }
  /// As OnDemand::know(); does nothing if all frames are kept here.
  [[nodiscard]] Result<void> know(const std::vector<std::string>& ids, Milliseconds max_age,
                                  const Deadline& deadline);
  /// @param what  a verb and its object
  /// @return kInvalidInput if only some frames are kept here
  [[nodiscard]] Result<void> check_keeps_all(const std::string& what) const;
  /// As Discovery::last_word().
  [[nodiscard]] Error last_word(Error error, const TimeLimit& limit);

  /// Makes a call. @return what it has ended with; also kPartitionTaken; kTimeout, if it was not
  ///   certain in time
  [[nodiscard]] Result<void> run(Task& task, const Deadline& deadline);

  /// Requests changes, and waits until they are known here; changes made by this process are also
  /// stored.
  /// @param frames  that they concern
  /// @param route  takes a directory; returns one Part, or all
  template <class Route>
  [[nodiscard]] Result<void> change(const Deadline& deadline, std::vector<std::string> frames,
                                    Route route) {
    ChangeTask<Route> task(std::move(route), std::move(frames));
    return run(task, deadline);
  }

  /// Tells owners something that they pass on to the others (TellTask).
  template <class Route>
  [[nodiscard]] Result<void> tell(const Deadline& deadline, Route route) {
    TellTask<Route> task(std::move(route));
    return run(task, deadline);
  }

  /// What one owner answers; empty: something else than it was asked for.
  template <class Answer, class Route>
  [[nodiscard]] Result<std::optional<Answer>> ask_one(const Deadline& deadline,
                                                      std::vector<std::string> frames,
                                                      Route route) {
    AskTask<Answer, Route> task(std::move(route), std::move(frames));
    auto asked = run(task, deadline);
    if (!asked) return tl::unexpected(std::move(asked.error()));
    return std::move(task.answer());
  }

  /// As ask_one(), of an owner that is named.
  template <class Answer, class Body>
  [[nodiscard]] Result<std::optional<Answer>> ask_partition(const std::string& partition,
                                                            const Body& body,
                                                            const Deadline& deadline) {
    return ask_one<Answer>(deadline, {}, [&](const Directory& directory) {
      return route_to_partition(directory, Request{0, partition, body});
    });
  }

  /// The list that a partition returns.
  template <class Item, class Body>
  [[nodiscard]] Result<std::vector<Item>> ask_all(const std::string& partition, const Body& body,
                                                  const Deadline& deadline) {
    return ask_partition<std::vector<Item>>(partition, body, deadline).map([](auto answer) {
      return std::move(answer).value_or(std::vector<Item>());
    });
  }

  /// What is known here of some frames, as soon as it is certain.
  /// @param max_age  as Task::max_age()
  /// @param find  takes a directory, with the structure's lock
  template <class Find>
  auto find(const Deadline& deadline, std::vector<std::string> frames, Milliseconds max_age,
            Find find) -> std::invoke_result_t<Find, const Directory&> {
    FindTask<Find> task(std::move(find), std::move(frames), max_age);
    auto known = run(task, deadline);
    if (!known) return tl::unexpected(std::move(known.error()));
    return std::move(task.found());
  }
  /// As above, of frames or partitions in general.
  template <class Find>
  auto find(const Deadline& deadline, Find find) -> std::invoke_result_t<Find, const Directory&> {
    return this->find(deadline, {}, Task::kAnyAge, std::move(find));
  }

  /// Sends requests until all are complete, without planning.
  void await(PendingRequests& requests, const Deadline& deadline);
  /// A reply for each part, without planning; kTimeout for those that have not replied by the
  /// deadline.
  [[nodiscard]] std::vector<Reply> ask(std::vector<Part>& parts, const Deadline& deadline);

  /// Sends each owner its share of streamed values, for which there is no reply. Each gets it as
  /// soon as it can take it, so none waits for one that is still being discovered.
  /// @param share_of  the share of the i-th part
  /// @param apply_here  applies the share of this process
  /// @return the first error, after all others were sent theirs: kUnreachable if an owner is not
  ///   reachable; as Transport::send()
  template <class ShareOf, class Apply>
  [[nodiscard]] Result<void> publish(const std::vector<Part>& parts, const Deadline& deadline,
                                     ShareOf share_of, Apply apply_here) {
    Result<void> outcome;
    std::vector<std::size_t> unsent(parts.size());
    std::iota(unsent.begin(), unsent.end(), std::size_t{0});
    Milliseconds wait{0};
    while (!unsent.empty()) {
      std::vector<std::size_t> later;
      for (const std::size_t i : unsent) {
        const bool last = deadline.over();
        const Deadline turn = deadline.within(std::exchange(wait, Milliseconds(0)));
        auto sent = publish_share(parts[i], share_of(i), turn, apply_here);
        if (!sent && sent.error().code == Errc::kTimeout && !last) {
          later.push_back(i);
        } else if (!sent && outcome) {
          outcome = std::move(sent);
        }
      }
      unsent = std::move(later);
      wait = PendingRequests::kTurn;
    }
    return outcome;
  }

 private:
  template <class Message, class Apply>
  [[nodiscard]] Result<void> publish_share(const Part& part, const Message& share,
                                           const Deadline& deadline, Apply apply_here) {
    if (part.owner == kHeldHere) return apply_here(share);
    {
      const Lock lock(structure_.mutex);
      if (auto ok = check_reachable(structure_.directory, {part}); !ok) return ok;
    }
    return transport_.send(part.partition, share, deadline.at());
  }

  void go_on(Call& call, Task& task, const Deadline& deadline);
  void plan(Call& call);
  void confirm(Call& call, const Deadline& deadline);
  void pause(const Call& call);
  [[nodiscard]] Result<void> conclude(const Call& call, const Deadline& deadline);

  Structure& structure_;
  Discovery& discovery_;
  Transport& transport_;
  OwnPartition& own_;
  ReplyTable replies_;
  const std::unique_ptr<OnDemand> on_demand_;
};

}  // namespace tfdude
