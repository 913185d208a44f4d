#pragma once

#include <functional>
#include <memory>
#include <numeric>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "tfdude/base/id.hpp"

#include "base/mutex.hpp"
#include "partition/routing.hpp"
#include "runtime/calls.hpp"
#include "runtime/discovery.hpp"
#include "runtime/on_demand.hpp"
#include "runtime/structure.hpp"
#include "transport/port.hpp"

namespace tfdude {

/// Requests of this process to the owners of frames, including itself. They are planned according
/// to the known structure, repeated until answered, and planned again if the structure has changed
/// meanwhile. One deadline covers all of this.
/// @par Thread safety  All functions are thread-safe, for callers that hold no lock.
class Requests {
 public:
  using Clock = Deadline::Clock;

  /// How often to ask a partition that may no longer be the owner.
  static constexpr int kAttempts = 3;
  /// How long a structure change may take to arrive if a reply says that the known structure is
  /// outdated.
  static constexpr Milliseconds kStructureDelay{100};
  /// Of several owners that are still being discovered, the first is waited for at most so long
  /// before all are tried again.
  static constexpr Milliseconds kTurn{2};
  /// Whether an owner denies what the plan has checked before.
  [[nodiscard]] static bool denies_plan(Errc code);

  /// The functions of this process as an owner.
  struct Own {
    std::function<Reply(const Request&)> answer;
    /// Announces changes made here to others, which are asked to build on them.
    std::function<void(const Deadline&)> tell;
    /// Waits until the changes of a request are stored here, if required.
    std::function<Result<void>(const Request&, const Deadline&)> await_stored;
    /// @return kPartitionTaken if it has given up its partition.
    std::function<Result<void>()> still_in;
  };

  /// For a participant that does not keep all frames.
  struct Follow {
    std::vector<std::string> trees;   ///< as Options::follow
    std::function<void()> on_routes;  ///< as OnDemand::Links
  };

  /// @param follow  absent: the structure of all partitions is kept here
  Requests(Structure& structure, Discovery& discovery, Transport& transport, Own own,
           std::optional<Follow> follow = {});

  /// The calls that wait for replies: for whoever receives these, and for waiting lookups.
  [[nodiscard]] Calls& calls() { return calls_; }
  /// The reply of this process itself.
  [[nodiscard]] Reply answer_here(const Request& request) const { return own_.answer(request); }
  /// @return kPartitionTaken if this process has given up its partition.
  [[nodiscard]] Result<void> still_in() const { return own_.still_in(); }

  /// Null: all frames are kept here.
  [[nodiscard]] OnDemand* on_demand() const { return on_demand_.get(); }
  /// As OnDemand::know(); does nothing if all frames are kept here.
  [[nodiscard]] Result<void> know(const std::vector<std::string>& ids, Milliseconds max_age,
                                  const Deadline& deadline);
  /// @param what  a verb and its object
  /// @return kInvalidInput if only some frames are kept here
  [[nodiscard]] Result<void> check_keeps_all(const std::string& what) const;
  /// As Discovery::last_word().
  [[nodiscard]] Error last_word(Error error, const Deadline& deadline);

  /// Runs an operation that may fail due to incomplete knowledge, and repeats it until the result
  /// is certain.
  /// @return also kTimeout, if it was not certain in time
  template <class Operation>
  auto after_discovery(const Deadline& deadline, Operation operation) -> decltype(operation()) {
    return discovery_.retry_until_known(deadline, [&]() -> decltype(operation()) {
      if (auto ok = own_.still_in(); !ok) return tl::unexpected(std::move(ok.error()));
      return operation();
    });
  }

  /// Plans with the directory, under the structure's lock.
  template <class Route>
  auto planned(const Deadline& deadline, Route route)
      -> std::invoke_result_t<Route, const Directory&> {
    return after_discovery(deadline, [&] { return locked(route); });
  }

  /// As after_discovery(), about certain frames, which are asked for if they are not kept here.
  /// @param names  returns their ids
  /// @param max_age  as OnDemand::know()
  template <class Names, class Operation>
  auto after_asking(const Deadline& deadline, Names names, Milliseconds max_age,
                    Operation operation) -> decltype(operation()) {
    if (on_demand_ == nullptr) return after_discovery(deadline, operation);
    if (auto ok = know(names(), max_age, deadline); !ok) {
      return tl::unexpected(std::move(ok.error()));
    }
    return once(deadline, operation);
  }

  /// Plans, asks, and plans again if the structure has changed meanwhile: the owner knows a newer
  /// structure than this process, or has not yet heard of a change that this process knows.
  template <class Route, class Ask,
            class Plan = typename std::invoke_result_t<Route, const Directory&>::value_type>
  std::invoke_result_t<Ask, Plan&> retry_on_stale_route(const Deadline& deadline, Route route,
                                                        Ask ask) {
    int attempts = 0;
    Milliseconds pause{5};
    while (true) {
      const std::uint64_t version = structure_.forest.structure_version();
      auto plan = planned(deadline, route);
      if (!plan) return tl::unexpected(std::move(plan.error()));
      auto result = ask(*plan);
      if (result) return result;
      if (result.error().code == Errc::kNotOwner && ++attempts < kAttempts && !deadline.over()) {
        await_structure_change(version, deadline);
      } else if (denies_plan(result.error().code) && !deadline.over(Clock::now() + pause)) {
        std::this_thread::sleep_for(pause);
        pause *= 2;
      } else {
        return result;
      }
    }
  }

  /// As above, about certain frames, which are asked for if they are not kept here.
  /// @param names  returns their ids
  template <class Names, class Route, class Ask,
            class Plan = typename std::invoke_result_t<Route, const Directory&>::value_type>
  std::invoke_result_t<Ask, Plan&> retry_on_stale_route(const Deadline& deadline, Names names,
                                                        Route route, Ask ask) {
    if (on_demand_ == nullptr) return retry_on_stale_route(deadline, route, ask);
    Milliseconds pause{5};
    Milliseconds max_age = OnDemand::kAnyAge;
    while (true) {
      const auto fresh = on_demand_->know(names(), max_age, deadline);
      if (!fresh) return tl::unexpected(fresh.error());
      // Whatever failed with an earlier answer may succeed with a fresh one.
      max_age = OnDemand::kFresh;
      auto plan = once(deadline, [&] { return locked(route); });
      if (!plan && !*fresh && !deadline.over()) continue;
      if (!plan) return tl::unexpected(std::move(plan.error()));
      auto result = ask(*plan);
      if (result) return result;
      const Errc code = result.error().code;
      const bool outdated = code == Errc::kNotOwner && pause <= kStructureDelay;
      if (!(outdated || denies_plan(code)) || deadline.over(Clock::now() + pause)) return result;
      if (!*fresh) continue;
      std::this_thread::sleep_for(pause);
      pause *= 2;
    }
  }

  /// A reply for each part; kTimeout for those that have not replied by the deadline.
  [[nodiscard]] std::vector<Reply> ask(std::vector<Part>& parts, const Deadline& deadline);

  /// Requests changes, and waits until they are known here; changes made by this process are also
  /// stored.
  [[nodiscard]] Result<void> change(std::vector<Part>& parts, const Deadline& deadline);

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
      wait = kTurn;
    }
    return outcome;
  }

  /// The list that a partition returns.
  template <class Item>
  [[nodiscard]] Result<std::vector<Item>> ask_list(Part part, const Deadline& deadline) {
    std::vector<Part> parts{std::move(part)};
    Reply reply = std::move(ask(parts, deadline).front());
    if (auto* error = std::get_if<Error>(&reply.body)) return tl::unexpected(std::move(*error));
    auto* all = std::get_if<std::vector<Item>>(&reply.body);
    return all != nullptr ? std::move(*all) : std::vector<Item>();
  }

  /// As ask_list(), by the partition's name, for everything that it has.
  template <class Item, class Body>
  [[nodiscard]] Result<std::vector<Item>> ask_all(const std::string& partition, const Body& body,
                                                  const Deadline& deadline) {
    return retry_on_stale_route(
        deadline,
        [&](const Directory& directory) -> Result<Part> {
          const auto owner = directory.owner(partition);
          if (!owner) return fail(Errc::kUnknownPartition, "no partition " + quote(partition));
          return route_to(directory, *owner, Request{0, partition, body});
        },
        [&](Part& part) { return ask_list<Item>(std::move(part), deadline); });
  }

  /// Waits until the structure of the replying owner has come up to the reply's epoch, so that the
  /// requester sees its change; at most until the deadline. If it has not come, missing frames are
  /// not reported as certain until it has.
  void await_change(const Part& part, const Reply& reply, const Deadline& deadline);

 private:
  template <class Route>
  auto locked(Route& route) {
    const Lock lock(structure_.mutex);
    return route(structure_.directory);
  }

  /// An operation with what others have answered, which is certain about frames, but not about
  /// partitions.
  template <class Operation>
  auto once(const Deadline& deadline, Operation operation) -> decltype(operation()) {
    if (auto ok = own_.still_in(); !ok) return tl::unexpected(std::move(ok.error()));
    auto result = operation();
    if (result || !Discovery::may_appear(result.error().code)) return result;
    if (result.error().code == Errc::kUnknownPartition) return after_discovery(deadline, operation);
    return tl::unexpected(discovery_.explained(std::move(result.error())));
  }

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

  void await_structure_change(std::uint64_t version, const Deadline& deadline);

  Structure& structure_;
  Discovery& discovery_;
  Transport& transport_;
  const Own own_;
  Calls calls_;
  const std::unique_ptr<OnDemand> on_demand_;
};

}  // namespace tfdude
