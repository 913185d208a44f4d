#include <tuple>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "runtime/participant.hpp"

// What a participant makes of what others say of themselves, and whom it tells.
namespace tfdude {
namespace {

// How often it is looked who has been silent for long enough to count as gone.
constexpr Milliseconds kLookForGone{50};

}  // namespace

std::shared_ptr<void> Participant::on_change(Events::Callback listener) {
  {
    const std::lock_guard lock(structure_.mutex);
    structure_.directory.changes().watch();
  }
  const std::uint64_t subscriber = events_->subscribe(std::move(listener));
  return {nullptr, [events = events_, subscriber](void*) { events->unsubscribe(subscriber); }};
}

// Under structure_.mutex, so that they are told in the order in which they happened.
void Participant::tell_changes() {
  for (const Directory::Outdated& one : structure_.directory.take_outdated()) {
    log().warn("what process {} of partition {} says is passed over, as process {} was later",
               one.incarnation, quote(one.partition), one.latest);
  }
  auto changes = structure_.directory.changes().take();
  if (changes.empty()) return;
  for (Change& change : changes) {
    change.time = wall_clock();
    const bool own = change.partition == partition_name_;
    const bool by_own = change.rival == partition_name_;
    if (change.kind == ChangeKind::kConflict && own) log().error("{}", change.message);
    if (change.kind == ChangeKind::kFrameOrphaned && (own || by_own))
      log().warn("{}", change.message);
  }
  events_->post(std::move(changes));
}

void Participant::on_page(const Page& page) {
  bool contested = false;
  {
    const std::lock_guard lock(structure_.mutex);
    structure_.directory.apply(page);
    contested = partition_ != nullptr && structure_.directory.contested();
    tell_changes();
  }
  structure_.changed.notify_all();
  look_at_routes();
  if (contested) conceder_->ask();
}

void Participant::on_presence(const Presence& presence) {
  bool appeared = false;
  bool ended = false;
  bool rivals = false;
  bool silent = false;
  {
    const std::lock_guard lock(structure_.mutex);
    if (presence.partition == partition_name_) {
      claim_.hear(presence);
      incarnations_.saw(presence.incarnation);
      rivals = presence_.serving && presence.serving;
      const bool is_later = std::tie(presence.incarnation, presence.ticket) >
                            std::tie(presence_.incarnation, presence_.ticket);
      if (rivals && is_later) give_up_partition(presence);
    } else {
      const bool before = structure_.directory.serving(presence.partition).has_value();
      structure_.directory.apply(presence, wall_clock());
      const bool after = structure_.directory.serving(presence.partition).has_value();
      appeared = after && !before;
      ended = before && !after;
      overtake();
      if (partition_ != nullptr) commits_->ask();
      // It may be the last that was missing of the structure of one who has returned.
      if (partition_ != nullptr && structure_.directory.contested()) conceder_->ask();
      silent = structure_.directory.any_silent();
    }
    tell_changes();
  }
  structure_.changed.notify_all();
  if (appeared || ended) {
    look_at_routes();
    lookups_.look_again();
  }
  const std::string who = quote(presence.partition) + " (host " + quote(presence.host) + ", pid " +
                          std::to_string(presence.pid) + ")";
  if (appeared) log().info("partition {} is there", who);
  if (ended) log().info("partition {} was stopped", who);
  if (ended) requests_.calls().on_lost(presence.partition);
  if (silent) start_to_look_for_gone();
  if (rivals) log().error("partition {} is served by another process, too", who);
}

void Participant::on_lost(const std::string& partition, std::uint64_t incarnation) {
  bool news = false;
  {
    const std::lock_guard lock(structure_.mutex);
    if (partition == partition_name_) claim_.lost(incarnation);
    news = structure_.directory.lost(partition, incarnation, wall_clock());
    if (news && partition_ != nullptr) commits_->ask();
    tell_changes();
  }
  structure_.changed.notify_all();
  if (!news) return;
  look_at_routes();
  lookups_.look_again();
  log().info("partition {} is lost: it is not heard any more", quote(partition));
  requests_.calls().on_lost(partition);
  start_to_look_for_gone();
}

void Participant::start_to_look_for_gone() {
  const std::lock_guard lock(pushing_mutex_);
  if (leaving_) return;
  if (!gone_look_) gone_look_.emplace(kLookForGone, [this] { look_for_gone(); });
  gone_look_->ask();
}

void Participant::look_for_gone() {
  bool gone = false;
  bool more = false;
  {
    const std::lock_guard lock(structure_.mutex);
    gone = structure_.directory.look_for_gone(Clock::now());
    more = structure_.directory.any_silent();
    if (gone && partition_ != nullptr) commits_->ask();
    tell_changes();
  }
  if (more) gone_look_->ask();
  if (!gone) return;
  structure_.changed.notify_all();
  look_at_routes();
  lookups_.look_again();
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
  {
    const std::lock_guard lock(structure_.mutex);
    forgotten = structure_.directory.forget(partition, 0, wall_clock());
    tell_changes();
  }
  structure_.changed.notify_all();
  look_at_routes();
  return forgotten;
}

}  // namespace tfdude
