#include "runtime/member_runner.hpp"

#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "base/mutex.hpp"
#include "partition/requests.hpp"
#include "runtime/wall_clock.hpp"
#include "tree/epoch.hpp"

namespace tfdude {
namespace {

// How often to check whether a silent partition counts as gone.
constexpr Milliseconds kLookForGone{50};

std::string who(const Presence& one) {
  return quote(one.partition) + " (host " + quote(one.host) + ", pid " + std::to_string(one.pid) +
         ")";
}

void log_outcome(const Outcome& outcome, const std::string& own) {
  for (const Directory::Outdated& one : outcome.outdated) {
    log().warn("messages of process {} of partition {} are ignored: process {} is newer",
               one.incarnation, quote(one.partition), one.latest);
  }
  for (const std::string& one : outcome.cut) {
    log().warn(
        "partition {} has more than this process keeps of others (--max-others, {} partitions): "
        "its structure stays incomplete here",
        quote(one), Directory::kMaxPartitions);
  }
  if (outcome.appeared) log().info("partition {} is reachable", who(*outcome.appeared));
  if (outcome.stopped) log().info("partition {} was stopped", who(*outcome.stopped));
  if (outcome.lost) log().info("partition {} is lost: it no longer sends", quote(*outcome.lost));
  if (outcome.rival)
    log().error("partition {} is also served by another process", who(*outcome.rival));
  if (!outcome.overtook) return;
  log().warn(
      "others knew a newer process of partition {}, whose clock was ahead; this process now has "
      "a higher number",
      quote(own));
}

}  // namespace

MemberRunner::MemberRunner(const Context& context, std::string partition, Listeners& listeners)
    : structure_(context.structure),
      transport_(context.transport),
      name_(std::move(partition)),
      listeners_(listeners),
      member_(context.structure.forest, context.structure.directory, name_),
      events_(std::make_shared<Events>(context.threads.callbacks)),
      gone_looks_(
          context.threads.calls,
          [this] {
            input([](Member& member) { member.on_time(Clock::now()); });
            return Loop::kNever;
          },
          kLookForGone) {}

void MemberRunner::stop() {
  gone_looks_.stop();
  if (commits_) commits_->stop();
}

// ---- inputs

template <class Input>
void MemberRunner::input(Input input) {
  Outcome outcome;
  {
    const Lock lock(structure_.mutex);
    input(member_);
    outcome = take_outcome();
  }
  react(outcome);
}

template <class Input>
void MemberRunner::input_of_joints(Input input) {
  this->input([&](Member& member) {
    const Lock joints(joints_mutex_);
    input(member);
  });
}

Outcome MemberRunner::take_outcome() {
  Outcome outcome = member_.take_outcome();
  if (outcome.gave_up) out_ = true;
  for (Change& change : outcome.events) {
    change.time = wall_clock();
    const bool own = change.partition == name_;
    const bool by_own = change.rival == name_;
    if (change.kind == ChangeKind::kConflict && own) log().error("{}", change.message);
    const bool warns =
        change.kind == ChangeKind::kFrameOrphaned || change.kind == ChangeKind::kJointConflict;
    if (warns && (own || by_own)) log().warn("{}", change.message);
  }
  // Posted here, to keep their order.
  if (!outcome.events.empty()) events_->post(std::move(outcome.events));
  return outcome;
}

void MemberRunner::react(const Outcome& outcome) {
  if (outcome.heard || outcome.routes) structure_.changed.notify_all();
  if (outcome.routes) listeners_.on_routes();
  if (outcome.to_commit) commits_->ask();
  if (outcome.to_reply) commits_->hurry();
  if (outcome.to_yield) listeners_.on_contest();
  if (outcome.look_for_gone) gone_looks_.ask();
  if (outcome.stopped) listeners_.on_gone(outcome.stopped->partition);
  if (outcome.lost) listeners_.on_gone(*outcome.lost);
  log_outcome(outcome, name_);
}

// Once: if the clocks differ, they usually differ from those of many.
void MemberRunner::report_clocks(const Presence& appeared) {
  const ClockKind own = structure_.clock.kind();
  const ClockKind theirs = clock_of(appeared);
  if (name_.empty() || theirs == own || clocks_reported_.exchange(true)) return;
  log().warn(
      "the clocks differ: partition {} uses the {} clock, and partition {} the {} clock; "
      "their stamps cannot be compared",
      quote(appeared.partition), to_string(theirs), quote(name_), to_string(own));
}

void MemberRunner::on_page(const Page& page) {
  input([&](Member& member) { member.on_page(page); });
}

void MemberRunner::on_presence(const Presence& presence) {
  input([&](Member& member) { member.on_presence(presence, wall_clock()); });
  // Of each presence: its sender may become reachable only later.
  if (presence.serving) report_clocks(presence);
}

void MemberRunner::on_lost(const std::string& partition, std::uint64_t incarnation,
                           std::chrono::nanoseconds early) {
  input([&](Member& member) { member.on_lost(partition, incarnation, wall_clock(), early); });
}

std::optional<Reply> MemberRunner::on_request(const PeerId& from, const Request& request) {
  const auto refused = refusal();
  std::optional<Reply> reply;
  input_of_joints(
      [&](Member& member) { reply = member.on_request(from, request, refused, wall_clock()); });
  return reply;
}

Reply MemberRunner::answer(const Request& request) {
  const auto refused = refusal();
  Reply reply;
  input_of_joints([&](Member& member) { reply = member.answer(request, refused, wall_clock()); });
  return reply;
}

Result<void> MemberRunner::release(const std::vector<std::string>& ids, const Deadline& deadline) {
  if (auto in = check_owns_partition(); !in) return in;
  if (auto why = refusal()) return tl::unexpected(*std::move(why));
  Result<void> released;
  input_of_joints([&](Member& member) { released = member.release(ids, wall_clock()); });
  return released ? commits_->flush(deadline.at()) : released;
}

Result<void> MemberRunner::forget(const std::string& partition) {
  Result<void> forgotten;
  input([&](Member& member) { forgotten = member.forget(partition, wall_clock()); });
  return forgotten;
}

void MemberRunner::yield(const std::set<PendingYield>& due, bool current) {
  input_of_joints([&](Member& member) { member.yield(due, current, wall_clock()); });
}

Result<std::size_t> MemberRunner::apply(const JointUpdate& update) {
  const Lock lock(joints_mutex_);
  return partition_->apply(update);
}

Result<std::size_t> MemberRunner::try_apply(const JointUpdate& update) {
  if (!joints_mutex_.try_lock()) return fail(Errc::kTimeout, "busy");
  const Lock lock(joints_mutex_, std::adopt_lock);
  return partition_->apply(update);
}

void MemberRunner::show(std::vector<JointInfo> joints) {
  const Lock lock(joints_mutex_);
  partition_->show(std::move(joints));
}

// ---- becoming an owner

void MemberRunner::open(std::unique_ptr<StateStore> store, Milliseconds save_every) {
  structure_.forest.on_restart([this](const HistoryRestart& restart) {
    Change change = restarted(restart, name_);
    change.time = wall_clock();
    log().warn("{}", change.message);
    events_->post({std::move(change)});
  });
  CommitLoop::Periods periods;
  periods.values = save_every;
  commits_.emplace(std::move(store), static_cast<CommitLoop::Effects&>(*this), periods);
}

Result<void> MemberRunner::serve(const StoredState* left,
                                 const std::vector<FrameSpec>& configured) {
  Result<void> served;
  input_of_joints([&](Member& member) {
    served = member.serve(left, configured, wall_clock());
    partition_ = member.partition();
  });
  return served;
}

void MemberRunner::announce(Presence presence) {
  if (presence.clock) presence.clock = structure_.clock.now().value_or(Time{});
  transport_.announce(presence);
}

void MemberRunner::introduce() {
  announce(with_rules([](Member& member) { return member.introduce(); }));
}

void MemberRunner::say_goodbye() {
  const auto last = with_rules([](Member& member) { return member.leave(); });
  if (last) announce(*last);
}

Result<void> MemberRunner::check_owns_partition() {
  if (!out()) return {};
  return fail(Errc::kPartitionTaken,
              with_rules([](const Member& member) { return member.given_up(); }));
}

// ---- changes

void MemberRunner::tell(const Deadline& deadline) {
  if (commits_ && commits_->pending()) (void)commits_->flush(deadline.at());
}

Result<void> MemberRunner::await_stored(const Deadline& deadline) {
  return commits_->stores() ? commits_->flush(deadline.at()) : Result<void>();
}

bool MemberRunner::responds(const Deadline& deadline) {
  const auto flushed = commits_->flush(deadline.at());
  return flushed || flushed.error().code != Errc::kTimeout;
}

std::optional<Error> MemberRunner::refusal() const {
  auto failure = commits_ ? commits_->failure() : std::nullopt;
  if (!failure) return std::nullopt;
  return Error{failure->code,
               "partition " + quote(name_) +
                   " accepts no changes until it can store them: " + failure->message};
}

Error MemberRunner::unless_unsaved(Error error, const std::string& id) {
  if (error.code != Errc::kAlreadyExists && error.code != Errc::kUnknownFrame) return error;
  auto why = refusal();
  const Lock lock(structure_.mutex);
  return why && partition_->is_unsaved(id) ? *std::move(why) : error;
}

std::shared_ptr<void> MemberRunner::on_change(Events::Callback listener) {
  {
    const Lock lock(structure_.mutex);
    structure_.directory.changes().watch();
  }
  return subscribe(std::move(listener));
}

// Conflicts are recorded anyway.
std::shared_ptr<void> MemberRunner::on_taken(Events::Callback listener) {
  return subscribe([own = name_, listener = std::move(listener)](const Change& change) {
    const bool taken = change.partition == own && change.frame.empty();
    if (change.kind == ChangeKind::kConflict && taken) listener(change);
  });
}

std::shared_ptr<void> MemberRunner::subscribe(Events::Callback listener) {
  const std::uint64_t subscriber = events_->subscribe(std::move(listener));
  return {nullptr, [events = events_, subscriber](void*) { events->unsubscribe(subscriber); }};
}

// ---- interface of the commit loop

Ready MemberRunner::take(bool values_due) {
  // The values of this moment are kept until they are copied, which may take long.
  const epoch::Guard guard;
  Ready ready;
  {
    const Lock lock(structure_.mutex);
    const Lock joints(joints_mutex_);
    ready = member_.take_ready(values_due);
  }
  if (partition_ != nullptr && !ready.refused) partition_->add_values(ready.rows);
  return ready;
}

void MemberRunner::publish(const Ready& ready) {
  std::optional<Presence> said;
  Outcome outcome;
  {
    const Lock lock(structure_.mutex);
    said = member_.stored(ready);
    outcome = take_outcome();
  }
  for (const Page& page : ready.pages) transport_.publish(page);
  if (said) announce(*said);
  structure_.changed.notify_all();
  react(outcome);
}

void MemberRunner::take_back(const Ready& ready) {
  const auto said = with_rules([&](Member& member) {
    const Lock joints(joints_mutex_);
    return member.not_stored(ready);
  });
  if (said) announce(*said);
}

void MemberRunner::reply(const PendingReply& pending) {
  if (!pending.what.empty()) {
    const auto* error = std::get_if<Error>(&pending.reply.body);
    log().info("{}: {}", pending.what, error != nullptr ? "rejected: " + error->message : "done");
  }
  transport_.reply(pending.to, pending.reply);
}

}  // namespace tfdude
