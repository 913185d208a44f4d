#include <algorithm>
#include <array>
#include <random>
#include <unistd.h>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "partition/claiming.hpp"
#include "partition/reconfigure.hpp"
#include "runtime/participant.hpp"
#include "store/sqlite_store.hpp"

namespace tfdude {
namespace {

// How often at most the others are asked whether what seems to be a conflict is one.
constexpr Milliseconds kConcedeEvery{100};

std::string host_name() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0) return "unknown";
  return name.data();
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
    std::random_device device;
    const std::lock_guard lock(structure_.mutex);
    member_.claim(host_name(), static_cast<std::uint32_t>(getpid()), wall_clock(), device());
  }
  if (auto claimed = claim_name(); !claimed) return claimed;
  conceder_.emplace(kConcedeEvery, [this] { concede(); });
  if (auto taken = take_frames(frames); !taken) return taken;
  if (auto serving = transport_->serve(partition_name_); !serving) return serving;
  if (auto stored = commits_->start(frames); !stored) return stored;
  introduce();
  return {};
}

void Participant::introduce() {
  Presence said;
  {
    const std::lock_guard lock(structure_.mutex);
    said = member_.introduce();
  }
  transport_->announce(said);
}

void Participant::say_goodbye() {
  std::optional<Presence> last;
  {
    const std::lock_guard lock(structure_.mutex);
    last = member_.leave();
  }
  if (last) transport_->announce(*last);
}

Result<StoredState> Participant::open_store(std::unique_ptr<StateStore>& store) {
  auto opened = open_sqlite_store(
      state_file(options_.state, options_.domain, partition_name_), partition_name_,
      options_.sync ? StoreSync::kEachChange : StoreSync::kAtCheckpoints);
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
  Result<void> taken;
  react(input_of_joints([&] {
    taken = member_.serve(kept ? &state : nullptr, frames, wall_clock());
    partition_ = member_.partition();
    if (taken) taken = set_timings(frames);
  }));
  if (taken) log_configured(state, frames);
  return taken;
}

Result<void> Participant::set_timings(const std::vector<FrameSpec>& frames) {
  for (const FrameSpec& frame : frames) {
    // One that was removed by request has no edge of which to say anything.
    if (!frame.timing || !structure_.forest.holds(frame.id)) continue;
    if (auto set = structure_.forest.set_timing(frame.id, *frame.timing); !set) return set;
  }
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

Result<void> Participant::claim_name() {
  introduce();
  Claiming::Patience patience;
  patience.meeting = std::chrono::ceil<Milliseconds>(transport_->discovery_time());
  Claiming claiming(member_.name_claim(), patience, Clock::now());
  while (true) {
    const bool awaits_presence = transport_->awaits_presence();
    Claiming::Step step{};
    std::optional<Presence> rival;
    {
      const std::lock_guard lock(structure_.mutex);
      step = claiming.next(Clock::now(), awaits_presence);
      if (step == Claiming::Step::kTake) member_.take_name();
      rival = member_.name_claim().rival();
    }
    if (step == Claiming::Step::kServe) return {};
    if (step == Claiming::Step::kTake) introduce();
    if (step == Claiming::Step::kWait) discovery_.wait_for_news();
    if (step != Claiming::Step::kLeave) continue;
    say_goodbye();
    const std::string who =
        rival ? ", on host " + rival->host + " by process " + std::to_string(rival->pid) : "";
    return fail(Errc::kPartitionTaken,
                "partition " + quote(partition_name_) + " is served already" + who);
  }
}

// A claim may have been taken back long ago by an owner whose pages are late: what is given up must stand after all
// of the others have told how far they are, and their structure up to there has come.
void Participant::concede() {
  std::set<Concession> due;
  {
    const std::lock_guard lock(structure_.mutex);
    due = member_.concessions();
  }
  if (due.empty()) return;
  const bool current = catch_up();
  react(input_of_joints([&] { member_.concede(due, current, wall_clock()); }));
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
    if (answered) requests_.await_change(parts[i], replies[i], deadline);
    const std::lock_guard lock(structure_.mutex);
    const Owner owner = parts[i].owner;
    const bool is_here = answered && structure_.directory.epoch(owner) >= replies[i].epoch;
    current = current && (is_here || !structure_.directory.reachable(owner));
  }
  return current;
}

Reply Participant::answer_here(const Request& request) {
  if (const auto* lookup = std::get_if<LookupRequest>(&request.body)) {
    return partition_->answer_lookup(request.sequence, *lookup);
  }
  if (std::holds_alternative<PastRequest>(request.body)) return partition_->answer_past(request);
  if (std::holds_alternative<WatchRequest>(request.body)) return answer_watch(request);
  const auto refused = refusal();
  Reply reply;
  react(input_of_joints([&] { reply = member_.answer(request, refused, wall_clock()); }));
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
  const auto refused = refusal();
  std::optional<Reply> reply;
  react(input_of_joints([&] { reply = member_.on_request(from, request, refused, wall_clock()); }));
  if (reply) transport_->reply(from, *reply);
}

void Participant::on_update(const Update& update) {
  if (partition_ != nullptr) partition_->apply(update);
}

}  // namespace tfdude
