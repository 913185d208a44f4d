#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "client/participant.hpp"

// What a participant makes of what others say of themselves, and whom it tells.
namespace tfdude {

std::shared_ptr<void> Participant::on_change(Events::Callback listener) {
  {
    const std::lock_guard lock(structure_mutex_);
    directory_.changes().watch();
  }
  const std::uint64_t subscriber = events_->subscribe(std::move(listener));
  return {nullptr, [events = events_, subscriber](void*) { events->unsubscribe(subscriber); }};
}

// Under structure_mutex_, so that they are told in the order in which they happened.
void Participant::tell_changes() {
  auto changes = directory_.changes().take();
  if (changes.empty()) return;
  for (Change& change : changes) {
    change.time = wall_clock();
    const bool own = change.partition == partition_name_;
    const bool by_own = change.rival == partition_name_;
    if (change.kind == ChangeKind::kConflict && own) log().error("{}", change.message);
    if (change.kind == ChangeKind::kFrameOrphaned && (own || by_own)) log().warn("{}", change.message);
  }
  events_->post(std::move(changes));
}

void Participant::on_page(const Page& page) {
  bool contested = false;
  {
    const std::lock_guard lock(structure_mutex_);
    directory_.apply(page);
    contested = partition_ != nullptr && directory_.contested();
    tell_changes();
  }
  structure_changed_.notify_all();
  look_at_watches();
  if (contested) conceder_->ask();
}

void Participant::on_presence(const Presence& presence) {
  bool appeared = false;
  bool rivals = false;
  {
    const std::lock_guard lock(structure_mutex_);
    if (presence.partition == partition_name_) {
      if (presence.incarnation == presence_.incarnation) return;
      // Who has given up, or only asks, does not hide who serves.
      if (rival_ && rival_->serving && !presence.serving) return;
      rival_ = presence;
      rivals = presence_.serving && presence.serving;
      if (rivals && presence.incarnation > presence_.incarnation) give_up_partition();
    } else {
      const auto before = directory_.serving(presence.partition);
      directory_.apply(presence, wall_clock());
      appeared = directory_.serving(presence.partition) && !before;
      if (appeared && partition_ != nullptr) commits_->ask();
      // It may be the last that was missing of the structure of one who has returned.
      if (partition_ != nullptr && directory_.contested()) conceder_->ask();
    }
    tell_changes();
  }
  structure_changed_.notify_all();
  if (appeared) {
    look_at_watches();
    lookups_.look_again();
  }
  const std::string who = quote(presence.partition) + " (host " + quote(presence.host) + ", pid " +
                          std::to_string(presence.pid) + ")";
  if (appeared) log().info("partition {} is there", who);
  if (rivals) log().error("partition {} is served by another process, too", who);
}

void Participant::on_lost(const std::string& partition, std::uint64_t incarnation) {
  bool news = false;
  {
    const std::lock_guard lock(structure_mutex_);
    if (rival_ && partition == rival_->partition && rival_->incarnation == incarnation)
      rival_.reset();
    news = directory_.lost(partition, incarnation, wall_clock());
    if (news && partition_ != nullptr) commits_->ask();
    tell_changes();
  }
  structure_changed_.notify_all();
  if (!news) return;
  look_at_watches();
  lookups_.look_again();
  log().info("partition {} has gone or fallen silent", quote(partition));
  calls_.on_lost(partition);
}

}  // namespace tfdude
