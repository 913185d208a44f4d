#include "partition/member.hpp"

#include <algorithm>
#include <tuple>

#include "tfdude/base/id.hpp"

#include "partition/requests.hpp"

namespace tfdude {

// ---- received messages

// A moved frame now has the younger claim, and missing parts of a conflict may have come.
void Member::look_for_contests() {
  if (partition_ != nullptr && directory_.contested()) outcome_.to_yield = true;
}

void Member::on_page(const Page& page) {
  directory_.apply(page);
  to_settle_ = true;
  outcome_.heard = true;
  look_for_contests();
}

void Member::on_presence(const Presence& presence, Time now) {
  outcome_.heard = to_settle_ = true;
  if (presence.partition == name_) {
    on_own_presence(presence);
    overtake(now);
    return;
  }
  const bool was_reachable = directory_.serving(presence.partition).has_value();
  const bool was_announced = directory_.announced(presence.partition);
  directory_.apply(presence, now);
  // Its pages may have come before.
  if (!was_announced && directory_.announced(presence.partition)) outcome_.appeared = presence;
  if (was_reachable && !directory_.serving(presence.partition)) outcome_.stopped = presence;
  overtake(now);
  if (partition_ != nullptr) outcome_.to_commit = true;
  look_for_contests();
}

void Member::on_own_presence(const Presence& presence) {
  claim_.hear(presence);
  incarnations_.saw(presence.incarnation);
  if (!presence_.serving || !presence.serving) return;
  outcome_.rival = presence;
  const bool is_later = std::tie(presence.incarnation, presence.ticket) >
                        std::tie(presence_.incarnation, presence_.ticket);
  if (is_later) give_up(presence);
}

void Member::on_lost(const std::string& partition, std::uint64_t incarnation, Time now,
                     std::chrono::nanoseconds early) {
  outcome_.heard = to_settle_ = true;
  if (partition == name_) {
    // Others may have believed a process that was never told here.
    if (!claim_.lost(incarnation) && presence_.serving && incarnation > presence_.incarnation) {
      directory_.others_know(incarnation);
    }
    overtake(now);
  }
  if (!directory_.lost(partition, incarnation, now, early)) return;
  outcome_.lost = partition;
  if (partition_ != nullptr) outcome_.to_commit = true;
}

void Member::on_time(Steady now) {
  to_settle_ = true;
  const bool owns = partition_ != nullptr && given_up_.empty();
  if (owns && partition_->on_time(now)) {
    outcome_.to_commit = true;
    look_for_contests();
  }
  if (!directory_.look_for_gone(now)) return;
  outcome_.heard = true;
  if (partition_ != nullptr) outcome_.to_commit = true;
}

std::optional<Reply> Member::on_request(const PeerId& from, const Request& request,
                                        const std::optional<Error>& rejection, Time now) {
  const bool changes = !is_read_only(request);
  Reply reply;
  if (!given_up_.empty()) {
    reply = {request.sequence, 0, Error{Errc::kNotOwner, given_up_}};
  } else if (changes && rejection) {
    reply = partition_->refuse(from, request, *rejection, now);
  } else if (changes && replies_.size() >= ReplyCache::kReplies) {
    // A disk that hangs reports nothing. More would also be more than is kept for repetitions.
    if (replies_.count({from, request.sequence}) != 0) return std::nullopt;
    return partition_->refuse(from, request,
                              {Errc::kTooMuch, "partition " + quote(presence_.partition) + " has " +
                                                   std::to_string(replies_.size()) +
                                                   " changes that wait for its disk, the limit"},
                              now);
  } else {
    reply = partition_->answer(from, request, now);
    look_for_contests();
  }
  // Changes that are not stored are not announced, however long that takes.
  if (!changes && rejection) reply.epoch = std::min(reply.epoch, told_epoch_);
  if (!changes || (!stores_ && is_of_values(request))) return reply;
  outcome_.to_reply = true;
  // A repeated request whose first copy still waits is dropped.
  replies_.try_emplace({from, request.sequence},
                       PendingReply{from, std::move(reply), describe(request)});
  return std::nullopt;
}

// ---- requests of its own process

Reply Member::answer(const Request& request, const std::optional<Error>& rejection, Time now) {
  if (rejection && is_of_structure(request)) return {request.sequence, 0, *rejection};
  Reply reply = partition_->answer(request, now);
  look_for_contests();
  // This process sees the change already; the others are informed asynchronously.
  outcome_.to_commit = !is_of_values(request) && !is_read_only(request);
  return reply;
}

Result<void> Member::release(const std::vector<std::string>& ids, Time now) {
  auto released = partition_->release(ids, now);
  if (released) outcome_.to_commit = true;
  return released;
}

Result<void> Member::forget(const std::string& partition, Time now) {
  auto forgotten = directory_.forget(partition, 0, now);
  if (forgotten) outcome_.heard = true;
  return forgotten;
}

std::set<PendingYield> Member::pending_yields() const {
  if (partition_ == nullptr || !given_up_.empty()) return {};
  return partition_->pending_yields();
}

void Member::yield(const std::set<PendingYield>& due, bool current, Time now) {
  if (partition_ == nullptr || !given_up_.empty()) return;
  if (current && partition_->yield(due, now)) outcome_.to_commit = true;
  if (!partition_->pending_yields().empty()) outcome_.to_yield = true;
}

// Lookups no longer find values of this process: no value is better than an old one.
void Member::give_up(const Presence& rival) {
  const std::string own = "process " + std::to_string(presence_.pid) + " on host " + presence_.host;
  given_up_ = "partition " + quote(rival.partition) + " was taken over by process " +
              std::to_string(rival.pid) + " on host " + rival.host + ", which did not hear " + own +
              "; " + own + " has given it up";
  presence_.serving = false;
  presence_.stopped = true;
  for (const FrameInfo& frame : forest_.frames()) {
    if (frame.owner == kHeldHere) (void)forest_.release(frame.id);
  }
  directory_.changes().add(
      {ChangeKind::kConflict, rival.partition, {}, {}, rival.partition, given_up_, {}});
  outcome_.gave_up = outcome_.to_commit = true;
}

// Others know a later incarnation of this partition, so they ignore this one: a predecessor with a
// different clock, or this process itself, which they have forgotten. While a rival serves, one of
// the two has to give up first.
void Member::overtake(Time now) {
  const auto latest = directory_.hidden_by(presence_.incarnation);
  if (partition_ == nullptr || !given_up_.empty() || !latest || claim_.served()) return;
  incarnations_.saw(*latest);
  const std::uint64_t next = incarnations_.next(now, presence_.ticket);
  // At the end of the range there is none.
  if (next <= presence_.incarnation) return;
  presence_.incarnation = next;
  partition_->overtake(presence_.incarnation);
  outcome_.overtook = presence_.incarnation;
  outcome_.to_commit = true;
}

// ---- becoming an owner

void Member::claim(const std::string& host, std::uint32_t pid, Time now, std::uint64_t random) {
  presence_ = {name_, incarnations_.next(now, random), host, pid, 0, false};
  presence_.ticket = presence_.incarnation;
  presence_.program = program_version();
  // This process serves with a later number, even if its clock is set back until then.
  incarnations_.saw(presence_.incarnation);
  claim_.claim(presence_);
}

Result<void> Member::serve(const StoredState* left, const std::vector<FrameSpec>& configured,
                           Time now) {
  if (left != nullptr) incarnations_.saw(left->epoch);
  if (const auto latest = directory_.hidden_by(0)) incarnations_.saw(*latest);
  presence_.incarnation = incarnations_.next(now, presence_.ticket);
  auto partition = std::make_unique<Partition>(name_, presence_.incarnation, forest_, directory_);
  auto taken = left != nullptr ? partition->restore(*left, configured, now)
                               : partition->load(configured, now);
  if (!taken) return taken;
  partition_ = std::move(partition);
  stores_ = left != nullptr;
  presence_.pages = partition_->page_count();
  presence_.serving = true;
  return {};
}

std::optional<Presence> Member::leave() {
  if (presence_.partition.empty() || announced_.stopped) return std::nullopt;
  presence_.serving = presence_.taken = false;
  presence_.stopped = true;
  return introduce();
}

// ---- actions

Ready Member::take_ready(bool values_due) {
  Ready ready;
  for (auto& [key, reply] : std::exchange(replies_, {})) ready.replies.push_back(std::move(reply));
  if (!given_up_.empty()) {
    ready.refused = Error{Errc::kNotOwner, given_up_};
    return ready;
  }
  Presence current = presence_;
  if (partition_ != nullptr) {
    ready.pages = partition_->take_pages();
    ready.rows = partition_->take_unsaved(values_due);
    current.pages = partition_->page_count();
    current.absent = directory_.absent();
  }
  if (!(current == announced_)) ready.presence = std::move(current);
  return ready;
}

std::optional<Presence> Member::stored(const Ready& ready) {
  if (!ready.refused) told_epoch_ = ready.rows.epoch;
  // Before others hear of it, and may change what they have got.
  if (!ready.refused && partition_ != nullptr && given_up_.empty()) {
    if (partition_->pass_on_stored(ready.rows.epoch)) {
      outcome_.to_commit = true;
      look_for_contests();
    }
  }
  // A partition that was given up meanwhile is not announced as served again.
  const bool stands = ready.presence && given_up_.empty();
  if (stands) {
    presence_.pages = ready.presence->pages;
    presence_.absent = ready.presence->absent;
  }
  if (!stands && !ready.refused) return std::nullopt;
  announced_ = presence_;
  // If this process was overtaken meanwhile, its new number is not stored yet.
  if (stands) announced_.incarnation = ready.presence->incarnation;
  return announced_;
}

std::optional<Presence> Member::not_stored(const Ready& ready) {
  partition_->still_unsaved(ready.rows, ready.pages);
  // A partition that is not served yet announces nothing that it could not store.
  if (!ready.presence || !announced_.serving || !given_up_.empty()) return std::nullopt;
  if (ready.presence->absent == announced_.absent) return std::nullopt;
  presence_.absent = announced_.absent = ready.presence->absent;
  // An incarnation that is not stored is not announced either.
  return announced_;
}

// The one place that says so: whoever waits for a plan, or keeps one, plans again.
void Member::compare_plans() {
  const std::pair now{forest_.structure_version(), directory_.version()};
  outcome_.routes = now != std::exchange(planned_with_, now);
}

Outcome Member::take_outcome() {
  if (partition_ != nullptr && given_up_.empty()) {
    const bool settles = std::exchange(to_settle_, false);
    // A yield may have waited for its end.
    if (settles && partition_->hands_over()) look_for_contests();
    if (settles && partition_->settle_handovers()) outcome_.to_commit = true;
    if (partition_->awaits_time()) outcome_.look_for_gone = true;
  }
  // A frame that was yielded or removed here may have been the last one that was contested.
  directory_.resolve_returns();
  if (directory_.any_pending()) outcome_.look_for_gone = true;
  compare_plans();
  outcome_.outdated = directory_.take_outdated();
  outcome_.cut = directory_.take_cut();
  outcome_.events = directory_.changes().take();
  return std::exchange(outcome_, {});
}

std::vector<PartitionInfo> Member::partitions() const {
  auto all = directory_.partitions();
  if (partition_ == nullptr) return all;
  for (PartitionInfo& info : all) {
    if (info.name != name_) continue;
    info.host = presence_.host;
    info.pid = presence_.pid;
    info.clock = clock_of(presence_);
    info.frames = partition_->frame_count();
  }
  return all;
}

}  // namespace tfdude
