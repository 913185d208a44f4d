#include <algorithm>
#include <array>
#include <random>
#include <unistd.h>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "partition/reconfigure.hpp"
#include "runtime/participant.hpp"
#include "store/sqlite_store.hpp"

namespace tfdude {
namespace {

// How long the participant of a killed predecessor may still seem alive.
constexpr Milliseconds kPredecessorGone{1500};

// How much longer than usual somebody who was met may take to say which partition it serves.
constexpr Milliseconds kSlowPresence{3000};

// How long one who claimed the name earlier may take to decide.
constexpr Milliseconds kDecision{3000};

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
  } else if (const auto* forget = std::get_if<ForgetRequest>(&request.body)) {
    what = "forget partition " + quote(forget->partition);
  } else if (const auto* move = std::get_if<MoveRequest>(&request.body)) {
    what = "move frame " + quote(request.id) + " under " + quote(move->parent);
  }
  return what;
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
    const std::lock_guard lock(structure_.mutex);
    presence_ = {partition_name_, 0, host_name(), static_cast<std::uint32_t>(getpid()), 0, false};
    presence_.incarnation = next_incarnation();
    presence_.ticket = presence_.incarnation;
    claim_.claim(presence_);
  }
  if (auto claimed = claim_name(); !claimed) return claimed;
  conceder_.emplace(kConcedeEvery, [this] { concede(); });
  if (auto taken = take_frames(frames); !taken) return taken;
  if (auto serving = transport_->serve(partition_name_); !serving) return serving;
  if (auto stored = commits_->start(frames); !stored) return stored;
  announce_own();
  return {};
}

// Under structure_.mutex.
std::uint64_t Participant::next_incarnation() const {
  std::random_device device;
  return incarnations_.next(wall_clock(), device());
}

void Participant::announce_own() {
  Presence said;
  {
    const std::lock_guard lock(structure_.mutex);
    said = announced_ = presence_;
  }
  transport_->announce(said);
}

// The last word. Nothing is said where nothing was.
void Participant::say_goodbye() {
  {
    const std::lock_guard lock(structure_.mutex);
    if (presence_.partition.empty() || announced_.stopped) return;
    presence_.serving = presence_.taken = false;
    presence_.stopped = true;
  }
  announce_own();
}

Result<StoredState> Participant::open_store(std::unique_ptr<StateStore>& store) {
  auto opened = open_sqlite_store(state_file(options_.state, options_.domain, partition_name_),
                                  partition_name_);
  if (!opened) return tl::unexpected(std::move(opened.error()));
  store = *std::move(opened);
  return store->load();
}

Result<void> Participant::take_frames(const std::vector<FrameSpec>& frames) {
  if (auto set = structure_.forest.set_default_timing(options_.history); !set) return set;
  structure_.forest.on_restart([this](const HistoryRestart& restart) {
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
    const std::lock_guard lock(structure_.mutex);
    return !structure_.directory.complete();
  };
  const bool any = !state.frames.empty() || !frames.empty();
  while (any && Clock::now() < discovery_.met_by() && incomplete()) discovery_.wait_for_news();
  if (any) await_gone();
  const std::lock_guard lock(structure_.mutex);
  const std::lock_guard joints(joints_mutex_);
  incarnations_.saw(state.epoch);
  if (const auto latest = structure_.directory.hidden_by(0)) incarnations_.saw(*latest);
  presence_.incarnation = next_incarnation();
  auto partition = std::make_unique<Partition>(partition_name_, presence_.incarnation,
                                               structure_.forest, structure_.directory);
  auto taken = kept ? partition->restore(state, frames, wall_clock())
                    : partition->load(frames, wall_clock());
  if (!taken) return taken;
  log_configured(state, frames);
  for (const FrameSpec& frame : frames) {
    // One that was removed by request has no edge of which to say anything.
    if (!structure_.forest.holds(frame.id)) continue;
    if (!frame.timing) continue;
    if (auto set = structure_.forest.set_timing(frame.id, *frame.timing); !set) return set;
  }
  partition_ = std::move(partition);
  presence_.pages = partition_->page_count();
  presence_.serving = true;
  tell_changes();
  return {};
}

// Who is said to be silent may be there again in a moment, or gone: that decides whose a frame is.
void Participant::await_gone() {
  const auto patience = Clock::now() + 2 * Absences::kGrace;
  const auto undecided = [this] {
    const std::lock_guard lock(structure_.mutex);
    return structure_.directory.awaits_silent();
  };
  while (Clock::now() < patience && undecided()) discovery_.wait_for_news();
}

// Says that the name is to be taken, looks round for as long as participants need to meet, and takes it if it may
// (NameClaim); one who was killed may still seem to serve for a moment.
Result<void> Participant::claim_name() {
  announce_own();
  const auto met = Clock::now() + transport_->discovery_time();
  {
    std::unique_lock lock(structure_.mutex);
    structure_.changed.wait_until(lock, met, [this] { return claim_.served(); });
  }
  while (transport_->awaits_presence() && Clock::now() < met + kSlowPresence)
    discovery_.wait_for_news();
  using Turn = NameClaim::Turn;
  Turn turn = Turn::kOthers;
  {
    std::unique_lock lock(structure_.mutex);
    structure_.changed.wait_until(lock, Clock::now() + kPredecessorGone,
                                  [this] { return !claim_.served(); });
    turn = claim_.to_take();
    presence_.taken = turn == Turn::kMine;
  }
  if (turn == Turn::kMine) {
    announce_own();
    std::unique_lock lock(structure_.mutex);
    structure_.changed.wait_until(lock, Clock::now() + kDecision,
                                  [&] { return (turn = claim_.to_serve()) != Turn::kWait; });
    if (turn != Turn::kOthers) return {};
  }
  std::optional<Presence> rival;
  {
    const std::lock_guard lock(structure_.mutex);
    rival = claim_.rival();
  }
  say_goodbye();
  const std::string who =
      rival ? ", on host " + rival->host + " by process " + std::to_string(rival->pid) : "";
  return fail(Errc::kPartitionTaken,
              "partition " + quote(partition_name_) + " is served already" + who);
}

// A claim may have been taken back long ago by an owner whose pages are late: what is given up must stand after all
// of the others have told how far they are, and their structure up to there has come.
void Participant::concede() {
  std::set<Concession> due;
  {
    const std::lock_guard lock(structure_.mutex);
    if (partition_ == nullptr || out_) return;
    due = partition_->concessions();
  }
  if (due.empty()) return;
  const bool current = catch_up();
  bool changed = false;
  bool more = false;
  {
    const std::lock_guard lock(structure_.mutex);
    if (out_) return;
    const std::lock_guard joints(joints_mutex_);
    if (current) changed = partition_->concede(due, wall_clock());
    more = !partition_->concessions().empty();
    tell_changes();
  }
  if (more) conceder_->ask();
  if (!changed) return;
  commits_->ask();
  look_at_routes();
}

// Whether all that those who are reachable had changed when this was called is known here now.
bool Participant::catch_up() {
  const Deadline deadline(options_.timeout);
  std::vector<Part> parts;
  {
    const std::lock_guard lock(structure_.mutex);
    for (const Owner owner : structure_.directory.reachable_owners()) {
      const std::string& name = structure_.directory.name(owner);
      parts.push_back({owner, name, Request{0, name, RemoveRequest{}}});
    }
  }
  const std::vector<Reply> replies = requests_.ask(parts, deadline);
  bool current = true;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const bool answered = std::holds_alternative<Done>(replies[i].body);
    if (answered) requests_.await_epoch(parts[i], replies[i].epoch, deadline);
    const std::lock_guard lock(structure_.mutex);
    const Owner owner = parts[i].owner;
    const bool is_here = answered && structure_.directory.epoch(owner) >= replies[i].epoch;
    current = current && (is_here || !structure_.directory.reachable(owner));
  }
  return current;
}

// Under structure_.mutex. Lookups find no value of this process's any more: none is better than an old one.
void Participant::give_up_partition(const Presence& rival) {
  given_up_ = "partition " + quote(rival.partition) + " was taken over by process " +
              std::to_string(rival.pid) + " on host " + rival.host + " while process " +
              std::to_string(presence_.pid) + " on host " + presence_.host +
              " was not heard, which has given it up";
  presence_.serving = false;
  presence_.stopped = true;
  out_ = true;
  for (const FrameInfo& frame : structure_.forest.frames()) {
    if (frame.owner == kHeldHere) (void)structure_.forest.release(frame.id);
  }
  Change change{ChangeKind::kConflict, rival.partition, {}, {}, rival.partition, given_up_, {}};
  structure_.directory.changes().add(std::move(change));
  commits_->ask();
}

// Under structure_.mutex. Others know of a later incarnation of this partition, so that they do not hear this one: a
// predecessor that had another clock, or this very process, which they have forgotten.
void Participant::overtake() {
  const auto latest = structure_.directory.hidden_by(presence_.incarnation);
  if (partition_ == nullptr || out_ || !latest || claim_.served()) return;
  incarnations_.saw(*latest);
  presence_.incarnation = next_incarnation();
  partition_->overtake(presence_.incarnation);
  log().warn(
      "others have known a later process of partition {}, whose clock was ahead: this one "
      "takes its place",
      quote(partition_name_));
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
    const std::lock_guard lock(structure_.mutex);
    const std::lock_guard joints(joints_mutex_);
    reply = partition_->answer(request, wall_clock());
    if (structure_.directory.contested()) conceder_->ask();
    tell_changes();
  }
  // This process sees the change already; the others are told without making it wait.
  if (!is_of_values(request) && !is_read_only(request)) commits_->ask();
  look_at_routes();
  return reply;
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
  const bool changes = !is_read_only(request);
  const auto refused = changes ? refusal() : std::nullopt;
  Reply reply;
  {
    const std::lock_guard lock(structure_.mutex);
    const std::lock_guard joints(joints_mutex_);
    if (out_) {
      reply = {request.sequence, 0, Error{Errc::kNotOwner, given_up_}};
    } else if (refused) {
      reply = partition_->refuse(from, request, *refused, wall_clock());
    } else {
      reply = partition_->answer(from, request, wall_clock());
      // A frame that was moved has the younger claim now.
      if (structure_.directory.contested()) conceder_->ask();
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
