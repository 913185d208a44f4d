#include "runtime/requests.hpp"

#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "partition/requests.hpp"

namespace tfdude {
namespace {

/// @return kUnreachable
Result<void> check_still_there(Structure& structure, const std::string& partition) {
  const Lock lock(structure.mutex);
  const auto owner = structure.directory.owner(partition);
  if (!owner || *owner == kHeldHere || structure.directory.reachable(*owner)) return {};
  return check_reachable(structure.directory, {Part{*owner, partition, {}}});
}

}  // namespace

Requests::Requests(Structure& structure, Discovery& discovery, Transport& transport,
                   OwnPartition& own, std::optional<Follow> follow)
    : structure_(structure),
      discovery_(discovery),
      transport_(transport),
      own_(own),
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
              "a client that follows only some frames (ClientOptions::follow) cannot " + what);
}

Error Requests::last_word(Error error, const TimeLimit& limit) {
  if (on_demand_ == nullptr) return discovery_.last_word(std::move(error), limit);
  return may_appear(error.code) ? discovery_.explained(std::move(error)) : error;
}

Result<void> Requests::send(const std::string& partition, const Request& request,
                            Clock::time_point until) {
  const auto read = own_.read(request);
  if (!read) {
    // Its loss may have been told after the plan, and before a reply was awaited.
    if (auto ok = check_still_there(structure_, partition); !ok) return ok;
    return transport_.send(partition, request, until);
  }
  replies_.on_reply(partition, *read);
  return {};
}

Result<void> Requests::run(Task& task, const Deadline& deadline) {
  Call call(replies_, task, deadline, on_demand_ != nullptr);
  while (call.state() != Call::State::kOver) go_on(call, task, deadline);
  return conclude(call, deadline);
}

void Requests::go_on(Call& call, Task& task, const Deadline& deadline) {
  switch (call.state()) {
    case Call::State::kKnow:
      return call.known(on_demand_->know(task.frames(), call.max_age(), deadline));
    case Call::State::kPlan:
      return plan(call);
    case Call::State::kDiscover:
      discovery_.wait_for_change(deadline);
      return call.resume();
    case Call::State::kAsk:
      await(call.requests(), deadline);
      return call.replied(Clock::now());
    case Call::State::kConfirm:
      return confirm(call, deadline);
    case Call::State::kStore:
      return call.stored(own_.await_stored(deadline), Clock::now());
    case Call::State::kPause:
      pause(call);
      return call.resume();
    case Call::State::kOver:
      return;
  }
}

void Requests::plan(Call& call) {
  const bool certain = discovery_.complete();
  if (auto ok = own_.check_owns_partition(); !ok) return call.fail(std::move(ok.error()));
  const Lock lock(structure_.mutex);
  call.plan(structure_.directory, structure_.forest.structure_version(), certain, Clock::now());
}

void Requests::await(PendingRequests& requests, const Deadline& deadline) {
  const std::vector<Part>& parts = requests.parts();
  // Own changes are announced before a request: other owners build on them.
  const bool builds = std::any_of(parts.begin(), parts.end(), [](const Part& part) {
    return part.owner != kHeldHere && !is_read_only(part.request);
  });
  if (builds) own_.announce_changes(deadline);
  for (const Part& part : parts) {
    if (part.owner != kHeldHere) transport_.prepare(part.partition);
  }
  while (!requests.wait_until(requests.step(Clock::now(), *this))) {
  }
}

void Requests::confirm(Call& call, const Deadline& deadline) {
  {
    Lock lock(structure_.mutex);
    structure_.changed.wait_until(lock, call.until(), [&]() TFDUDE_REQUIRES(structure_.mutex) {
      return call.confirm(structure_.directory, Clock::now());
    });
    if (!call.late().empty()) discovery_.fell_behind();
  }
  if (call.outdates() && on_demand_ != nullptr) on_demand_->outdate();
  for (const std::string& partition : call.late()) {
    log().warn("partition {} has made a change that has not arrived here within {}",
               quote(partition), deadline.text());
  }
}

void Requests::pause(const Call& call) {
  Lock lock(structure_.mutex);
  structure_.changed.wait_until(lock, call.until(), [&] {
    return call.awaits() && structure_.forest.structure_version() != *call.awaits();
  });
}

Result<void> Requests::conclude(const Call& call, const Deadline& deadline) {
  const Result<void>& outcome = call.outcome();
  if (outcome || call.certainty() == Call::Certainty::kFinal) return outcome;
  if (call.certainty() == Call::Certainty::kKnown) {
    return tl::unexpected(discovery_.explained(outcome.error()));
  }
  return tl::unexpected(discovery_.undecided(outcome.error(), deadline));
}

std::vector<Reply> Requests::ask(std::vector<Part>& parts, const Deadline& deadline) {
  PendingRequests requests(replies_, parts, deadline);
  await(requests, deadline);
  return requests.take_replies();
}

}  // namespace tfdude
