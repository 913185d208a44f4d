#pragma once

#include <functional>
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
#include "runtime/structure.hpp"
#include "transport/port.hpp"

namespace tfdude {

/// Requests of this process to the owners of frames, itself among them: planned by what is known of the structure, sent again
/// until they are answered, and planned again where the structure has changed meanwhile. One deadline counts for all of that.
/// @par Thread safety  All functions, by callers that hold no lock.
class Requests {
 public:
  using Clock = Deadline::Clock;

  /// How often an owner is asked that may not be the owner any more.
  static constexpr int kAttempts = 3;
  /// How long the structure may take to reach us where a reply says that ours is old.
  static constexpr Milliseconds kStructureDelay{100};
  /// Whether an owner denies what the plan has checked before it was asked.
  [[nodiscard]] static bool denies_plan(Errc code);

  /// What this process does as an owner.
  struct Own {
    std::function<Reply(const Request&)> answer;
    /// Has what was changed here told to others, who are asked to build on it.
    std::function<void(const Deadline&)> tell;
    /// Waits until what a request has changed here is stored, if it is to be.
    std::function<Result<void>(const Request&, const Deadline&)> await_stored;
    /// @return kPartitionTaken once it has given its partition up.
    std::function<Result<void>()> still_in;
  };

  Requests(Structure& structure, Discovery& discovery, Transport& transport, Own own)
      : structure_(structure), discovery_(discovery), transport_(transport), own_(std::move(own)) {}

  /// Those that wait for replies: for who gets these, and for lookups that wait.
  [[nodiscard]] Calls& calls() { return calls_; }
  /// The reply of this process itself.
  [[nodiscard]] Reply answer_here(const Request& request) const { return own_.answer(request); }
  /// @return kPartitionTaken once this process has given its partition up.
  [[nodiscard]] Result<void> still_in() const { return own_.still_in(); }

  /// Runs an operation that may fail for what is not known yet; repeats it until it is known for sure.
  /// @return also kTimeout, where it was not known by then
  template <class Operation>
  auto after_discovery(const Deadline& deadline, Operation operation) -> decltype(operation()) {
    return discovery_.retry_until_known(deadline, [&]() -> decltype(operation()) {
      if (auto ok = own_.still_in(); !ok) return tl::unexpected(std::move(ok.error()));
      return operation();
    });
  }

  /// Plans under the structure's lock.
  template <class Route>
  auto planned(const Deadline& deadline, Route route) -> decltype(route()) {
    return after_discovery(deadline, [&] {
      const Lock lock(structure_.mutex);
      return route();
    });
  }

  /// Plans, asks, and plans again where the structure has changed meanwhile: the owner asked knows something
  /// newer than this process, or has not heard yet of a change that this process knows of.
  template <class Route, class Ask, class Plan = typename std::invoke_result_t<Route>::value_type>
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

  /// A reply for each part; kTimeout of who has not replied by the deadline.
  [[nodiscard]] std::vector<Reply> ask(std::vector<Part>& parts, const Deadline& deadline);

  /// Asks for changes, and waits until they are known here, and stored where this process has made them.
  [[nodiscard]] Result<void> change(std::vector<Part>& parts, const Deadline& deadline);

  /// Hands an owner its share of what is streamed, for which there is no reply.
  /// @param apply_here  takes what is this process's own
  /// @return kUnreachable where the owner is not there; as Transport::send
  template <class Message, class Apply>
  [[nodiscard]] Result<void> publish(const Part& part, const Message& share,
                                     const Deadline& deadline, Apply apply_here) {
    if (part.owner == kHeldHere) return apply_here(share);
    {
      const Lock lock(structure_.mutex);
      if (auto ok = check_reachable(structure_.directory, {part}); !ok) return ok;
    }
    return transport_.send(part.partition, share, deadline.at());
  }

  /// The list that is a partition's answer.
  template <class Item>
  [[nodiscard]] Result<std::vector<Item>> ask_list(Part part, const Deadline& deadline) {
    std::vector<Part> parts{std::move(part)};
    Reply reply = std::move(ask(parts, deadline).front());
    if (auto* error = std::get_if<Error>(&reply.body)) return tl::unexpected(std::move(*error));
    auto* all = std::get_if<std::vector<Item>>(&reply.body);
    return all != nullptr ? std::move(*all) : std::vector<Item>();
  }

  /// The same by the partition's name, of all that it has.
  template <class Item, class Body>
  [[nodiscard]] Result<std::vector<Item>> ask_all(const std::string& partition, const Body& body,
                                                  const Deadline& deadline) {
    return retry_on_stale_route(
        deadline,
        [&]() -> Result<Part> {
          const auto owner = structure_.directory.owner(partition);
          if (!owner) return fail(Errc::kUnknownPartition, "no partition " + quote(partition));
          return route_to(structure_.directory, *owner, Request{0, partition, body});
        },
        [&](Part& part) { return ask_list<Item>(std::move(part), deadline); });
  }

  /// Waits until the structure of who has answered is here up to the reply's epoch, so that whoever changed something finds it
  /// changed; no longer than the deadline. Nothing is denied after that before it has come.
  void await_change(const Part& part, const Reply& reply, const Deadline& deadline);

 private:
  void await_structure_change(std::uint64_t version, const Deadline& deadline);

  Structure& structure_;
  Discovery& discovery_;
  Transport& transport_;
  const Own own_;
  Calls calls_;
};

}  // namespace tfdude
