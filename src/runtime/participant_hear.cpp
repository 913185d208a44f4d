#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "runtime/participant.hpp"

// What a participant makes of what others say of themselves, and whom it tells.
namespace tfdude {
namespace {

// How often it is looked who has been silent for long enough to count as gone.
constexpr Milliseconds kLookForGone{50};

std::string who(const Presence& one) {
  return quote(one.partition) + " (host " + quote(one.host) + ", pid " + std::to_string(one.pid) +
         ")";
}

void log_outcome(const Outcome& outcome, const std::string& own) {
  for (const Directory::Outdated& one : outcome.outdated) {
    log().warn("what process {} of partition {} says is passed over, as process {} was later",
               one.incarnation, quote(one.partition), one.latest);
  }
  if (outcome.appeared) log().info("partition {} is there", who(*outcome.appeared));
  if (outcome.stopped) log().info("partition {} was stopped", who(*outcome.stopped));
  if (outcome.lost)
    log().info("partition {} is lost: it is not heard any more", quote(*outcome.lost));
  if (outcome.rival)
    log().error("partition {} is served by another process, too", who(*outcome.rival));
  if (!outcome.overtook) return;
  log().warn(
      "others have known a later process of partition {}, whose clock was ahead: this one takes "
      "its "
      "place",
      quote(own));
}

}  // namespace

std::shared_ptr<void> Participant::on_change(Events::Callback listener) {
  {
    const std::lock_guard lock(structure_.mutex);
    structure_.directory.changes().watch();
  }
  const std::uint64_t subscriber = events_->subscribe(std::move(listener));
  return {nullptr, [events = events_, subscriber](void*) { events->unsubscribe(subscriber); }};
}

Outcome Participant::take_outcome() {
  Outcome outcome = member_.take_outcome();
  if (outcome.gave_up) out_ = true;
  for (Change& change : outcome.events) {
    change.time = wall_clock();
    const bool own = change.partition == partition_name_;
    const bool by_own = change.rival == partition_name_;
    if (change.kind == ChangeKind::kConflict && own) log().error("{}", change.message);
    if (change.kind == ChangeKind::kFrameOrphaned && (own || by_own))
      log().warn("{}", change.message);
  }
  // Here, so that they are told in the order in which they happened.
  if (!outcome.events.empty()) events_->post(std::move(outcome.events));
  return outcome;
}

void Participant::react(const Outcome& outcome) {
  if (outcome.heard) structure_.changed.notify_all();
  if (outcome.routes) look_at_routes();
  if (outcome.to_commit) commits_->ask();
  if (outcome.to_reply) commits_->hurry();
  if (outcome.to_concede) conceder_->ask();
  if (outcome.look_for_gone) start_to_look_for_gone();
  if (outcome.others) lookups_.look_again();
  if (outcome.stopped) requests_.calls().on_lost(outcome.stopped->partition);
  if (outcome.lost) requests_.calls().on_lost(*outcome.lost);
  log_outcome(outcome, partition_name_);
}

void Participant::on_page(const Page& page) {
  react(input([&] { member_.on_page(page); }));
}

void Participant::on_presence(const Presence& presence) {
  react(input([&] { member_.on_presence(presence, wall_clock()); }));
}

void Participant::on_lost(const std::string& partition, std::uint64_t incarnation) {
  react(input([&] { member_.on_lost(partition, incarnation, wall_clock()); }));
}

void Participant::start_to_look_for_gone() {
  const std::lock_guard lock(pushing_mutex_);
  if (leaving_) return;
  if (!gone_look_) {
    gone_look_.emplace(kLookForGone,
                       [this] { react(input([this] { member_.on_time(Clock::now()); })); });
  }
  gone_look_->ask();
}

Result<void> Participant::forget(const std::string& partition) {
  const Deadline deadline = call_deadline();
  // All who are there are to be told.
  if (auto all = await_discovery(deadline); !all) return all;
  auto parts = requests_.planned(deadline, [&]() -> Result<std::vector<Part>> {
    if (!structure_.directory.owner(partition)) {
      return fail(Errc::kUnknownPartition, "no partition " + quote(partition));
    }
    if (auto ok = structure_.directory.check_not_there(partition); !ok) {
      return tl::unexpected(std::move(ok.error()));
    }
    const ForgetRequest body{partition, structure_.directory.latest_incarnation(partition)};
    std::vector<Part> all;
    for (const Owner one : structure_.directory.reachable_owners()) {
      all.push_back(
          {one, structure_.directory.name(one), Request{0, structure_.directory.name(one), body}});
    }
    if (partition_ != nullptr) {
      all.push_back({kHeldHere, partition_name_, Request{0, partition_name_, body}});
    }
    return all;
  });
  if (!parts) return tl::unexpected(std::move(parts.error()));
  if (auto told = requests_.change(*parts, deadline); !told) return told;
  Result<void> forgotten;
  react(input([&] { forgotten = member_.forget(partition, wall_clock()); }));
  return forgotten;
}

}  // namespace tfdude
