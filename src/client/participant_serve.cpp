#include <array>
#include <limits>
#include <unistd.h>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "client/participant.hpp"
#include "store/sqlite_store.hpp"

namespace tfdude {
namespace {

// How long the participant of a killed predecessor may still seem alive.
constexpr Milliseconds kPredecessorGone{1500};

// How much longer than usual somebody who was met may take to say which partition it serves.
constexpr Milliseconds kSlowPresence{3000};

// How often at most the others are asked whether what seems to be a conflict is one.
constexpr Milliseconds kConcedeEvery{100};

// How often own changes of the structure are published at most.
constexpr Milliseconds kPublishEvery{1};

std::string host_name() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0) return "unknown";
  return name.data();
}

// Whether it leaves the structure as it is.
bool is_of_values(const Request& request) {
  return std::holds_alternative<UpdateRequest>(request.body) ||
         std::holds_alternative<JointUpdate>(request.body);
}

// One line a change of the structure; values change too often for it.
void log_change(const Request& request, const Reply& reply) {
  std::string what;
  if (const auto* add = std::get_if<AddRequest>(&request.body)) {
    what = "add frame " + quote(request.id) + " under " + quote(add->parent);
  } else if (const auto* remove = std::get_if<RemoveRequest>(&request.body)) {
    if (remove->tops.empty()) return;
    what = "remove, with all below,";
    for (const std::string& top : remove->tops) what += " " + quote(top);
  } else if (const auto* move = std::get_if<MoveRequest>(&request.body)) {
    what = "move frame " + quote(request.id) + " under " + quote(move->parent);
  } else {
    return;
  }
  const auto* error = std::get_if<Error>(&reply.body);
  log().info("{}: {}", what, error != nullptr ? "refused: " + error->message : "done");
}

}  // namespace

Result<void> Participant::serve(const std::vector<FrameSpec>& frames) {
  {
    const std::lock_guard lock(structure_mutex_);
    presence_ = {partition_name_,
                 static_cast<std::uint64_t>(nanoseconds(wall_clock())),
                 host_name(),
                 static_cast<std::uint32_t>(getpid()),
                 0,
                 false};
  }
  if (auto claimed = claim_name(); !claimed) return claimed;
  publisher_.emplace(kPublishEvery, [this] { (void)commit(); });
  conceder_.emplace(kConcedeEvery, [this] { concede(); });
  if (auto taken = take_frames(frames); !taken) return taken;
  if (auto serving = transport_->serve(partition_name_); !serving) return serving;
  if (auto stored = commit(); !stored) return stored;
  if (store_ != nullptr) {
    // Others are served already, and what they change is stored.
    const std::lock_guard publishing(publish_mutex_);
    if (auto stored = store_->save_configured(frames); !stored) return stored;
    saver_.emplace(options_.save_every, [this] { save_values(); });
  }
  transport_->announce(presence_);
  return {};
}

Result<StoredState> Participant::open_store() {
  auto opened = open_sqlite_store(state_file(options_.state, options_.domain, partition_name_),
                                  partition_name_);
  if (!opened) return tl::unexpected(std::move(opened.error()));
  store_ = *std::move(opened);
  return store_->load();
}

Result<void> Participant::take_frames(const std::vector<FrameSpec>& frames) {
  if (auto set = forest_.set_default_timing(options_.history); !set) return set;
  StoredState state;
  if (!options_.state.empty()) {
    auto stored = open_store();
    if (!stored) return tl::unexpected(std::move(stored.error()));
    state = *std::move(stored);
  }
  // What is left is judged by what the others own now.
  const auto incomplete = [this] {
    if (transport_->awaits_presence()) return true;
    const std::lock_guard lock(structure_mutex_);
    return !directory_.complete();
  };
  while (!state.frames.empty() && Clock::now() < settle_deadline_ && incomplete()) wait_for_news();
  const std::lock_guard lock(structure_mutex_);
  const std::lock_guard joints(joints_mutex_);
  auto partition =
      std::make_unique<Partition>(partition_name_, presence_.incarnation, forest_, directory_);
  auto taken = store_ != nullptr ? partition->restore(state, frames, wall_clock())
                                 : partition->load(frames, wall_clock());
  if (!taken) return taken;
  for (const FrameSpec& frame : frames) {
    // One that was removed by request has no edge of which to say anything.
    if (!forest_.holds(frame.id)) continue;
    Result<void> set;
    if (frame.timing) set = forest_.set_timing(frame.id, *frame.timing);
    if (set && !frame.correlation.empty()) set = forest_.correlate(frame.id, frame.correlation);
    if (!set) return set;
  }
  partition_ = std::move(partition);
  presence_.pages = partition_->page_count();
  presence_.serving = true;
  tell_changes();
  return {};
}

// Says that the name is to be taken, and looks round for as long as participants need to meet. Of two
// who claim at once, the earlier has it; one who was killed may still seem to serve for a moment.
Result<void> Participant::claim_name() {
  transport_->announce(presence_);
  const auto met = Clock::now() + transport_->settle_time();
  {
    std::unique_lock lock(structure_mutex_);
    structure_changed_.wait_until(lock, met, [this] { return rival_ && rival_->serving; });
  }
  while (transport_->awaits_presence() && Clock::now() < met + kSlowPresence) wait_for_news();
  std::unique_lock lock(structure_mutex_);
  structure_changed_.wait_until(lock, Clock::now() + kPredecessorGone,
                                [this] { return !rival_ || !rival_->serving; });
  if (!rival_ || (!rival_->serving && rival_->incarnation > presence_.incarnation)) return {};
  return fail(Errc::kPartitionTaken, "partition " + quote(rival_->partition) +
                                         " is served already, on host " + rival_->host +
                                         " by process " + std::to_string(rival_->pid));
}

Result<void> Participant::commit() {
  const std::lock_guard publishing(publish_mutex_);
  std::vector<Page> pages;
  StateChange unsaved;
  std::optional<Presence> news;
  {
    const std::lock_guard lock(structure_mutex_);
    if (partition_ == nullptr) return {};
    if (out_) {
      news = presence_;
    } else {
      pages = partition_->take_pages();
      if (store_ != nullptr) {
        const std::lock_guard joints(joints_mutex_);
        unsaved = partition_->take_unsaved();
      }
      auto absent = directory_.absent();
      if (partition_->page_count() != presence_.pages || absent != presence_.absent) {
        presence_.pages = partition_->page_count();
        presence_.absent = std::move(absent);
        news = presence_;
      }
    }
  }
  Result<void> saved;
  if (!unsaved.empty()) saved = store_->save(unsaved);
  if (!saved) {
    log().error("{}", saved.error().message);
    const std::lock_guard lock(structure_mutex_);
    const std::lock_guard joints(joints_mutex_);
    partition_->still_unsaved(unsaved);
  }
  for (const Page& page : pages) transport_->publish(page);
  if (news) transport_->announce(*news);
  structure_changed_.notify_all();
  return saved;
}

// A claim may have been taken back long ago by an owner whose pages are late: what is given up must stand after all
// of the others have told how far they are, and their structure up to there has come.
void Participant::concede() {
  std::set<Concession> due;
  {
    const std::lock_guard lock(structure_mutex_);
    if (partition_ == nullptr || out_) return;
    due = partition_->concessions();
  }
  if (due.empty()) return;
  const bool current = catch_up();
  bool changed = false;
  bool more = false;
  {
    const std::lock_guard lock(structure_mutex_);
    if (out_) return;
    const std::lock_guard joints(joints_mutex_);
    if (current) changed = partition_->concede(due, wall_clock());
    more = !partition_->concessions().empty();
    tell_changes();
  }
  if (more) conceder_->ask();
  if (changed) (void)commit();
}

// Whether all that those who are reachable had changed when this was called is known here now.
bool Participant::catch_up() {
  const auto deadline = Clock::now() + options_.timeout;
  std::vector<Part> parts;
  {
    const std::lock_guard lock(structure_mutex_);
    for (const Owner owner : directory_.reachable_owners()) {
      const std::string& name = directory_.name(owner);
      parts.push_back({owner, name, Request{0, name, RemoveRequest{}}});
    }
  }
  const std::vector<Reply> replies = ask(parts, deadline);
  bool current = true;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const bool answered = std::holds_alternative<Done>(replies[i].body);
    if (answered) await_epoch(parts[i], replies[i].epoch, deadline);
    const std::lock_guard lock(structure_mutex_);
    const Owner owner = parts[i].owner;
    const bool is_here = answered && directory_.epoch(owner) >= replies[i].epoch;
    current = current && (is_here || !directory_.reachable(owner));
  }
  return current;
}

void Participant::save_values() {
  const std::lock_guard publishing(publish_mutex_);
  if (store_ == nullptr || out_) return;
  const auto [edges, commit] = forest_.changed_since(saved_commit_);
  if (edges.empty()) return;
  std::vector<StoredJoint> joints;
  {
    const std::lock_guard lock(joints_mutex_);
    joints = partition_->take_changed_joints();
  }
  if (auto saved = store_->save_values(edges, joints); !saved) {
    log().error("{}", saved.error().message);
    const std::lock_guard lock(joints_mutex_);
    partition_->still_unsaved(joints);
    return;
  }
  saved_commit_ = commit;
}

// Under structure_mutex_. Lookups find no value of this process's any more: none is better than an old one.
void Participant::give_up_partition() {
  given_up_ = "partition " + quote(rival_->partition) + " was taken over by process " +
              std::to_string(rival_->pid) + " on host " + rival_->host + " while process " +
              std::to_string(presence_.pid) + " on host " + presence_.host +
              " was not heard, which has given it up";
  presence_.serving = false;
  // A claim that everybody may ignore.
  presence_.incarnation = std::numeric_limits<std::uint64_t>::max();
  out_ = true;
  for (const FrameInfo& frame : forest_.frames()) {
    if (frame.owner == kHeldHere) (void)forest_.release(frame.id);
  }
  Change change{ChangeKind::kConflict, rival_->partition, {}, {}, rival_->partition, given_up_, {}};
  directory_.changes().add(std::move(change));
  publisher_->ask();
}

Reply Participant::answer_here(const Request& request) {
  if (const auto* lookup = std::get_if<LookupRequest>(&request.body)) {
    return partition_->answer_lookup(request.sequence, *lookup);
  }
  if (std::holds_alternative<PastRequest>(request.body)) return partition_->answer_past(request);
  if (std::holds_alternative<WatchRequest>(request.body)) return answer_watch(request);
  Reply reply;
  {
    const std::lock_guard lock(structure_mutex_);
    const std::lock_guard joints(joints_mutex_);
    reply = partition_->answer(request, wall_clock());
    if (directory_.contested()) conceder_->ask();
    tell_changes();
  }
  // This process sees the change already; the others are told without making it wait.
  if (!is_of_values(request) && !is_question(request)) publisher_->ask();
  look_at_watches();
  return reply;
}

Result<void> Participant::change_here(const Request& request) {
  Reply reply = answer_here(request);
  if (auto* error = std::get_if<Error>(&reply.body)) return tl::unexpected(std::move(*error));
  return {};
}

void Participant::on_request(const PeerId& from, const Request& request) {
  if (partition_ == nullptr) return;
  if (const auto* lookup = std::get_if<LookupRequest>(&request.body)) {
    transport_->reply(from, partition_->answer_lookup(request.sequence, *lookup));
    return;
  }
  if (std::holds_alternative<PastRequest>(request.body)) {
    transport_->reply(from, partition_->answer_past(request));
    return;
  }
  if (std::holds_alternative<WatchRequest>(request.body)) {
    transport_->reply(from, answer_watch(request));
    return;
  }
  Reply reply;
  {
    const std::lock_guard lock(structure_mutex_);
    const std::lock_guard joints(joints_mutex_);
    if (out_) {
      reply = {request.sequence, 0, Error{Errc::kNotOwner, given_up_}};
    } else {
      reply = partition_->answer(from, request, wall_clock());
      // A frame that was moved has the younger claim now.
      if (directory_.contested()) conceder_->ask();
    }
    tell_changes();
  }
  log_change(request, reply);
  // Before the reply, so that whoever gets that finds the structure changed, and the change stored.
  if (!is_question(request) && (!is_of_values(request) || store_ != nullptr)) {
    if (auto stored = commit(); !stored && std::holds_alternative<Done>(reply.body)) {
      reply.body = Error{Errc::kState, "done, but not stored: " + stored.error().message};
    }
  }
  transport_->reply(from, reply);
}

void Participant::on_update(const Update& update) {
  if (partition_ != nullptr) partition_->apply(update);
}

}  // namespace tfdude
