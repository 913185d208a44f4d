#include "runtime/requests.hpp"

#include <algorithm>
#include <utility>

#include "base/log.hpp"
#include "partition/requests.hpp"
#include "runtime/asking.hpp"

namespace tfdude {

Requests::Requests(Structure& structure, Discovery& discovery, Transport& transport, Own own,
                   std::optional<Follow> follow)
    : structure_(structure),
      discovery_(discovery),
      transport_(transport),
      own_(std::move(own)),
      on_demand_(!follow
                     ? nullptr
                     : std::make_unique<OnDemand>(
                           structure, discovery, std::move(follow->trees),
                           OnDemand::Links{[this](std::vector<Part>& parts, const Deadline& by) {
                                             return ask(parts, by);
                                           },
                                           std::move(follow->on_routes)})) {}

Result<void> Requests::know(const std::vector<std::string>& ids, Milliseconds max_age,
                            const Deadline& deadline) {
  if (on_demand_ == nullptr) return {};
  return on_demand_->know(ids, max_age, deadline).map([](bool) {});
}

Result<void> Requests::check_keeps_all(const std::string& what) const {
  if (on_demand_ == nullptr) return {};
  return fail(Errc::kInvalidInput,
              "a client that follows only some frames (Options::follow) cannot " + what);
}

Error Requests::last_word(Error error, const Deadline& deadline) {
  if (on_demand_ == nullptr) return discovery_.last_word(std::move(error), deadline);
  return Discovery::may_appear(error.code) ? discovery_.explained(std::move(error)) : error;
}

bool Requests::denies_plan(Errc code) {
  return code == Errc::kAlreadyExists || code == Errc::kUnknownParent || code == Errc::kCycle;
}

void Requests::await_structure_change(std::uint64_t version, const Deadline& deadline) {
  Lock lock(structure_.mutex);
  structure_.changed.wait_until(lock, deadline.within(kStructureDelay).at(),
                                [&] { return structure_.forest.structure_version() != version; });
}

void Requests::await_change(const Part& part, const Reply& reply, const Deadline& deadline) {
  const std::uint64_t epoch = reply.epoch;
  Lock lock(structure_.mutex);
  structure_.directory.saw_lamport_time(reply.lamport_time);
  if (on_demand_ != nullptr) {
    lock.unlock();
    return on_demand_->changed(part.owner, epoch);
  }
  const auto arrived_or_gone = [&]() TFDUDE_REQUIRES(structure_.mutex) {
    return structure_.directory.epoch(part.owner) >= epoch ||
           !structure_.directory.reachable(part.owner);
  };
  const bool arrived = structure_.changed.wait_until(lock, deadline.at(), arrived_or_gone);
  structure_.directory.note_announced_epoch(part.owner, epoch);
  if (arrived) return;
  discovery_.fell_behind();
  log().warn("partition {} has made a change that has not arrived here within {}",
             quote(part.partition), deadline.text());
}

std::vector<Reply> Requests::ask(std::vector<Part>& parts, const Deadline& deadline) {
  // Own changes are announced before a request: other owners build on them.
  const bool builds = std::any_of(parts.begin(), parts.end(), [](const Part& part) {
    return part.owner != kHeldHere && !is_read_only(part.request);
  });
  if (builds) own_.tell(deadline);
  for (const Part& part : parts) {
    if (part.owner != kHeldHere) transport_.prepare(part.partition);
  }
  Milliseconds wait{0};
  const Asking::Send send = [&](const std::string& partition, const Request& request) {
    const Deadline turn = deadline.within(std::exchange(wait, Milliseconds(0)));
    auto sent = transport_.send(partition, request, turn.at());
    const bool again = !sent && sent.error().code == Errc::kTimeout && !deadline.over();
    if (again) sent.error().code = Errc::kNotYet;
    return sent;
  };
  Asking asking(calls_, parts);
  asking.send_due(Clock::now(), send);
  asking.answer(own_.answer);
  while (true) {
    wait = kTurn;
    const bool unsent = asking.send_unsent(send);
    wait = Milliseconds(0);
    if (asking.wait_until(unsent ? Clock::now() : std::min(asking.due(), deadline.at()))) break;
    const auto now = Clock::now();
    if (!unsent && deadline.over(now)) {
      asking.give_up(deadline);
      break;
    }
    asking.send_due(now, send);
  }
  return asking.take_replies();
}

Result<void> Requests::change(std::vector<Part>& parts, const Deadline& deadline) {
  if (parts.size() == 1 && parts[0].owner == kHeldHere) {
    Reply reply = own_.answer(parts[0].request);
    if (auto* error = std::get_if<Error>(&reply.body)) return tl::unexpected(std::move(*error));
    return own_.await_stored(parts[0].request, deadline);
  }
  const std::vector<Reply> replies = ask(parts, deadline);
  Result<void> outcome;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (const auto* error = std::get_if<Error>(&replies[i].body)) {
      // An error of storing is returned, whatever a retry with a fresh route may bring.
      if (outcome || error->code == Errc::kState) outcome = tl::unexpected(*error);
    } else if (parts[i].owner != kHeldHere) {
      await_change(parts[i], replies[i], deadline);
    } else if (auto stored = own_.await_stored(parts[i].request, deadline); !stored && outcome) {
      outcome = std::move(stored);
    }
  }
  return outcome;
}

}  // namespace tfdude
