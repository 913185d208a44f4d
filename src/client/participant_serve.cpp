#include <algorithm>
#include <array>
#include <limits>
#include <unistd.h>

#include "tfdude/base/id.hpp"
#include "tfdude/partition/reconfigure.hpp"

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

std::string host_name() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0) return "unknown";
  return name.data();
}

// Whether it leaves the structure as it is.
bool is_of_values(const Request& request) {
  return std::holds_alternative<UpdateRequest>(request.body) ||
         std::holds_alternative<PartialUpdateRequest>(request.body) ||
         std::holds_alternative<JointUpdate>(request.body) ||
         std::holds_alternative<ReviseRequest>(request.body);
}

// One line a change of the structure; values change too often for it.
std::string line_of(const Request& request) {
  std::string what;
  if (const auto* add = std::get_if<AddRequest>(&request.body)) {
    what = "add frame " + quote(request.id) + " under " + quote(add->parent);
  } else if (const auto* remove = std::get_if<RemoveRequest>(&request.body)) {
    what = "remove, with all below,";
    for (const std::string& top : remove->tops) what += " " + quote(top);
  } else if (const auto* move = std::get_if<MoveRequest>(&request.body)) {
    what = "move frame " + quote(request.id) + " under " + quote(move->parent);
  }
  return what;
}

bool is_of_structure(const Request& request) {
  return std::holds_alternative<AddRequest>(request.body) ||
         std::holds_alternative<RemoveRequest>(request.body) ||
         std::holds_alternative<MoveRequest>(request.body);
}

// What a configuration changes of what was kept; before the first one there is nothing. Orphans are told as events, with
// those of other partitions.
void log_configured(const StoredState& state, const std::vector<FrameSpec>& frames) {
  if (state.configured.empty() && state.frames.empty()) return;
  for (const ConfiguredChange& change : configured_changes(state, frames)) {
    if (change.kind == ConfiguredChange::Kind::kOrphan) continue;
    const bool loses = change.kind == ConfiguredChange::Kind::kRemove ||
                       change.kind == ConfiguredChange::Kind::kRest;
    log().log(loses ? spdlog::level::warn : spdlog::level::info, "configuration: {}",
              describe(change));
  }
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
  conceder_.emplace(kConcedeEvery, [this] { concede(); });
  if (auto taken = take_frames(frames); !taken) return taken;
  if (auto serving = transport_->serve(partition_name_); !serving) return serving;
  if (auto stored = commits_->start(frames); !stored) return stored;
  transport_->announce(presence_);
  return {};
}

Result<StoredState> Participant::open_store(std::unique_ptr<StateStore>& store) {
  auto opened = open_sqlite_store(state_file(options_.state, options_.domain, partition_name_),
                                  partition_name_);
  if (!opened) return tl::unexpected(std::move(opened.error()));
  store = *std::move(opened);
  return store->load();
}

Result<void> Participant::take_frames(const std::vector<FrameSpec>& frames) {
  if (auto set = forest_.set_default_timing(options_.history); !set) return set;
  forest_.on_restart([this](const HistoryRestart& restart) {
    Change change = restarted(restart, partition_name_);
    change.time = wall_clock();
    log().warn("{}", change.message);
    events_->post({std::move(change)});
  });
  StoredState state;
  std::unique_ptr<StateStore> store;
  if (!options_.state.empty()) {
    auto stored = open_store(store);
    if (!stored) return tl::unexpected(std::move(stored.error()));
    state = *std::move(stored);
  }
  const bool kept = store != nullptr;
  CommitLoop::Periods periods;
  periods.values = options_.save_every;
  commits_.emplace(std::move(store), static_cast<CommitLoop::Effects&>(*this), periods);
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
  auto taken = kept ? partition->restore(state, frames, wall_clock())
                    : partition->load(frames, wall_clock());
  if (!taken) return taken;
  log_configured(state, frames);
  for (const FrameSpec& frame : frames) {
    // One that was removed by request has no edge of which to say anything.
    if (!forest_.holds(frame.id)) continue;
    if (!frame.timing) continue;
    if (auto set = forest_.set_timing(frame.id, *frame.timing); !set) return set;
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
  if (!changed) return;
  commits_->ask();
  look_at_watches();
}

// Whether all that those who are reachable had changed when this was called is known here now.
bool Participant::catch_up() {
  const Deadline deadline(options_.timeout);
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
  commits_->ask();
}

Reply Participant::answer_here(const Request& request) {
  if (const auto* lookup = std::get_if<LookupRequest>(&request.body)) {
    return partition_->answer_lookup(request.sequence, *lookup);
  }
  if (std::holds_alternative<PastRequest>(request.body)) return partition_->answer_past(request);
  if (std::holds_alternative<WatchRequest>(request.body)) return answer_watch(request);
  const auto refused = is_of_structure(request) ? refusal() : std::nullopt;
  if (refused) return {request.sequence, 0, *refused};
  Reply reply;
  {
    const std::lock_guard lock(structure_mutex_);
    const std::lock_guard joints(joints_mutex_);
    reply = partition_->answer(request, wall_clock());
    if (directory_.contested()) conceder_->ask();
    tell_changes();
  }
  // This process sees the change already; the others are told without making it wait.
  if (!is_of_values(request) && !is_question(request)) commits_->ask();
  look_at_watches();
  return reply;
}

Result<void> Participant::change_here(const Request& request, const Deadline& deadline) {
  Reply reply = answer_here(request);
  if (auto* error = std::get_if<Error>(&reply.body)) return tl::unexpected(std::move(*error));
  return is_of_structure(request) ? await_stored(deadline) : Result<void>();
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
  const bool changes = !is_question(request);
  const auto refused = changes ? refusal() : std::nullopt;
  Reply reply;
  {
    const std::lock_guard lock(structure_mutex_);
    const std::lock_guard joints(joints_mutex_);
    if (out_) {
      reply = {request.sequence, 0, Error{Errc::kNotOwner, given_up_}};
    } else if (refused) {
      reply = partition_->refuse(from, request, *refused, wall_clock());
    } else {
      reply = partition_->answer(from, request, wall_clock());
      // A frame that was moved has the younger claim now.
      if (directory_.contested()) conceder_->ask();
    }
    // What is not stored is not told, for as long as that may take.
    if (!changes && commits_->failure()) reply.epoch = std::min(reply.epoch, told_epoch_);
    tell_changes();
  }
  if (changes && (commits_->stores() || !is_of_values(request))) {
    commits_->reply({from, std::move(reply), line_of(request)});
  } else {
    transport_->reply(from, reply);
  }
}

void Participant::on_update(const Update& update) {
  if (partition_ != nullptr) partition_->apply(update);
}

}  // namespace tfdude
