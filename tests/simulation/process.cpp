#include "simulation/process.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "partition/requests.hpp"
#include "simulation/cast.hpp"

namespace tfdude::simulation {
namespace {

constexpr Instant kMeeting = milliseconds(300);  // time of discovery
constexpr Instant kSearchTime = milliseconds(1000);
// As Attention and Peers do: a peer that is needed is looked at often, and asked for a sign of
// life; all others are heard by their announcements, and looked at rarely.
constexpr Instant kLook = milliseconds(60);
constexpr Instant kNeededFor = milliseconds(2000);
constexpr Patience kPatience{milliseconds(450), milliseconds(1875), milliseconds(1875),
                             milliseconds(200)};
constexpr std::uint64_t kLooksPerAnnouncement = 5;
constexpr std::uint64_t kLooksPerRareLook = 3;
constexpr Instant kTellCountEvery = milliseconds(200);
constexpr Instant kLookForGone = milliseconds(50);
constexpr Instant kYieldEvery = milliseconds(100);

}  // namespace

PeerId peer_of(std::uint64_t process) {
  PeerId peer{};
  std::memcpy(peer.data(), &process, sizeof process);
  return peer;
}

std::uint64_t process_of(const PeerId& peer) {
  std::uint64_t process = 0;
  std::memcpy(&process, peer.data(), sizeof process);
  return process;
}

Process::Process(Surroundings& world, Setting setting)
    : world_(world),
      setting_(std::move(setting)),
      forest_([this] { return wall(); }),
      directory_(forest_, setting_.partition),
      member_(forest_, directory_, setting_.partition),
      pushes_(forest_, SIZE_MAX, *this),
      watches_(*this),
      commits_(*this, {}, setting_.disk != nullptr) {
  directory_.changes().watch();
}

void Process::start() {
  born_ = looked_ = world_.timeline.now();
  tick();
  if (!serves_or_claims()) return;
  member_.claim("host" + std::to_string(host()), static_cast<std::uint32_t>(id()), wall(),
                world_.random.engine()());
  announce(member_.introduce());
  Claiming::Patience patience;
  patience.meeting = std::chrono::duration_cast<milliseconds>(kMeeting);
  claiming_.emplace(member_.name_claim(), patience, world_.timeline.steady());
  step_claim();
}

// ---- how it becomes an owner

bool Process::awaits_presence() const {
  return std::any_of(peers_.begin(), peers_.end(),
                     [](const auto& known) { return !known.second.said && !known.second.silent; });
}

void Process::step_claim() {
  using Step = Claiming::Step;
  const Step step = claiming_->next(world_.timeline.steady(), awaits_presence());
  if (step == Step::kServe) return take_frames();
  if (step == Step::kLeave) return leave();
  if (step == Step::kTake) {
    member_.take_name();
    announce(member_.introduce());
  }
  later("claim", milliseconds(5), [this] { step_claim(); });
}

// The remaining frames are judged by the frames of others now, and by whether silent partitions are
// gone.
void Process::take_frames() {
  const Instant now = world_.timeline.now();
  const bool incomplete =
      now < born_ + kSearchTime && (awaits_presence() || !directory_.complete());
  const bool undecided =
      now < born_ + kSearchTime + milliseconds(3 * Absences::kGrace) && directory_.awaits_silent();
  if (incomplete || undecided) return later("claim", milliseconds(5), [this] { take_frames(); });
  serve();
}

// Frames of another partition can be taken over only once that is gone.
bool Process::is_too_early(const Error& error) const {
  const auto handed = forest_.info(kHanded);
  return error.code == Errc::kAlreadyExists && handed && handed->owner != kHeldHere;
}

void Process::serve() {
  std::optional<StoredState> left;
  if (setting_.disk != nullptr) left = setting_.disk->load();
  const auto taken = member_.serve(left ? &*left : nullptr, setting_.configured, wall());
  if (!taken && is_too_early(taken.error())) {
    world_.count("a deputy was started too early");
    too_early_ = true;
    return leave();
  }
  if (!taken) {
    world_.violation("a partition does not serve", partition() + ": " + taken.error().message);
    return leave();
  }
  serving_ = true;
  if (left && left->epoch >= member_.presence().incarnation) {
    world_.violation("an incarnation goes back",
                     partition() + " had stored epoch " + std::to_string(left->epoch) +
                         " and is served as " + std::to_string(member_.presence().incarnation));
  }
  perform(commits_.begin(now()));
  // A daemon that starts needs room on the disk, and ends if there is none.
  if (!commits_.started()) return leave();
  // Its first change is synced.
  if (setting_.disk != nullptr) setting_.disk->checkpoint();
  announce(member_.introduce());
  react();
}

void Process::leave() {
  announce(member_.leave());
  ended_ = true;
}

// ---- faults

void Process::resume() {
  if (--pauses_ > 0) return;
  resumed_ = world_.timeline.now();
  for (const auto& what : std::exchange(backlog_, {})) run(what);
}

void Process::run(std::function<void()> what) {
  if (paused()) {
    backlog_.push_back(std::move(what));
  } else if (!ended_) {
    what();
  }
}

void Process::later(const char* kind, Instant wait, std::function<void()> what) {
  world_.timeline.after(wait, {kind, id()}, [weak = weak_from_this(), what = std::move(what)] {
    if (const auto self = weak.lock()) self->run(what);
  });
}

// ---- what it hears

void Process::met(std::uint64_t peer) {
  peers_.try_emplace(peer).first->second.heard.last = world_.timeline.steady();
}

void Process::tick() {
  look_for_silent();
  later("tick", kLook, [this] { tick(); });
}

void Process::look_for_silent() {
  const Instant now = world_.timeline.now();
  const Instant late = std::max(Instant(0), now - std::exchange(looked_, now) - kLook);
  ++looks_;
  std::size_t heard = 0;
  for (auto& [peer, known] : peers_) {
    known.heard.pass_over(late);
    look_at(peer, known);
    if (known.said && !known.silent) ++heard;
  }
  if (world_.plan.tells_count) tell_count(heard);
}

// As Contact does: a new participant knows by this number whether it has discovered all.
void Process::tell_count(std::size_t heard) {
  const Instant now = world_.timeline.now();
  if (!presence_ || heard == told_count_ || now - told_count_at_ < kTellCountEvery) return;
  told_count_ = heard;
  told_count_at_ = now;
  announce(presence_);
}

void Process::show_life(Peer& known) {
  known.heard.last = world_.timeline.steady();
  if (!known.silent || !known.said) return;
  known.silent = false;
  member_.on_presence(*known.said, wall());
  react();
}

void Process::look_at(std::uint64_t peer, Peer& known) {
  const bool needed = known.used && world_.timeline.now() - *known.used < kNeededFor;
  known.heard.need(needed, world_.timeline.steady());
  const bool announces = (looks_ + peer) % kLooksPerAnnouncement == 0;
  if (announces && world_.network.announces(peer, *this)) return show_life(known);
  const Presence* said = known.known();
  if (said == nullptr || known.silent) return;
  if (!needed && looks_ % kLooksPerRareLook != 0) return;
  const Silence silence = judge(known.heard, kPatience, world_.timeline.steady());
  const bool asks = silence.kind == Silence::Kind::kAsk;
  if (asks && world_.network.answers(peer, *this)) return show_life(known);
  if (silence.kind != Silence::Kind::kLost) return;
  known.silent = true;
  world_.count(known.heard.replied && needed ? "a loss was noticed by who needs it"
                                             : "a loss was noticed late");
  member_.on_lost(said->partition, said->incarnation, wall(), silence.early);
  react();
}

void Process::hear(std::uint64_t from, const Sample& sample) {
  Peer& peer = peers_[from];
  const bool was_silent = std::exchange(peer.silent, false);
  peer.heard.last = world_.timeline.steady();
  if (const auto* page = std::get_if<Page>(&sample)) {
    world_.steps.mix(page->epoch + page->number);
    member_.on_page(*page);
    if (!peer.said || peer.said->incarnation < page->incarnation) {
      peer.by_page.emplace();
      peer.by_page->partition = page->partition;
      peer.by_page->incarnation = page->incarnation;
    }
    if (was_silent && peer.said) {
      member_.on_presence(*peer.said, wall());
    }
  } else {
    const auto& presence = std::get<Presence>(sample);
    peer.heard.present = true;
    world_.steps.mix(presence.incarnation + presence.pages);
    if (was_silent || !peer.said || !(*peer.said == presence)) {
      peer.said = presence;
      member_.on_presence(presence, wall());
    }
  }
  react();
}

void Process::react() {
  ++inputs_;
  const Outcome outcome = member_.take_outcome();
  if (outcome.to_commit) (void)commits_.ask();
  if (outcome.to_reply) commits_.hurry();
  look_at_commits();
  if (outcome.to_yield && !std::exchange(yielding_, true)) {
    later("yield", kYieldEvery, [this] { yield(); });
  }
  if (outcome.look_for_gone && !std::exchange(looking_for_gone_, true)) {
    later("look for gone", kLookForGone, [this] {
      looking_for_gone_ = false;
      member_.on_time(world_.timeline.steady());
      react();
    });
  }
  if (outcome.stopped) replies_.on_lost(outcome.stopped->partition);
  if (outcome.lost) replies_.on_lost(*outcome.lost);
  const auto calls = calls_;
  for (const auto& one : calls) one->go_on();
  watches_.go_on();
  calls_.erase(
      std::remove_if(calls_.begin(), calls_.end(), [](const auto& one) { return one->over(); }),
      calls_.end());
  if (outcome.gave_up) ended_ = true;
  if (outcome.routes) watches_.look_again();
  tell_planned(outcome);
  count(outcome);
}

void Process::tell_planned(const Outcome& outcome) {
  if (planned_.empty()) return;
  const std::uint64_t structure = forest_.structure_version();
  const Planned::Told told{std::exchange(told_structure_, structure) != structure, outcome.routes};
  for (const auto& one : planned_) {
    if (const auto planned = one.lock()) planned->react(told, world_.violation);
  }
}

void Process::count(const Outcome& outcome) {
  if (outcome.gave_up) world_.count("a process gave its partition up");
  if (outcome.overtook) world_.count("a process overtook its predecessor");
  if (!outcome.outdated.empty()) world_.count("an older process was ignored");
  for (const Change& event : outcome.events) {
    if (event.kind == ChangeKind::kFrameTakenOver) world_.count("a frame was taken over");
    if (event.kind == ChangeKind::kFrameOrphaned) world_.count("a frame was orphaned");
    if (event.kind == ChangeKind::kConflict) world_.count("a conflict was told");
  }
}

// ---- what it knows

bool Process::discovered() const {
  const bool met = world_.timeline.now() >= born_ + kSearchTime;
  return met && !awaits_presence() && directory_.behind() == nullptr;
}

// Frames may be given up only after all others have reported the epochs of their structure.
void Process::yield() {
  const auto due = member_.pending_yields();
  yielding_ = false;
  if (due.empty()) return;
  yielding_ = true;
  const auto task = std::make_shared<CatchUpTask>();
  begin("yield", task, [this, due, task](const Result<void>& asked) {
    yielding_ = false;
    member_.yield(due, asked && task->caught_up(directory_), wall());
    react();
  });
}

std::size_t Process::open_calls() const {
  const auto open =
      std::count_if(calls_.begin(), calls_.end(), [](const auto& one) { return !one->over(); });
  return static_cast<std::size_t>(open) + waiting_.size();
}

std::vector<std::string> Process::structure(const Counts& counts) const {
  std::vector<std::string> lines;
  for (const FrameInfo& frame : forest_.frames()) {
    const std::string& owner = directory_.name(frame.owner);
    if (!directory_.reachable(frame.owner) || !counts(frame.id, owner)) continue;
    lines.push_back(frame.id + " < " + frame.parent + " @ " + owner);
  }
  std::sort(lines.begin(), lines.end());
  return lines;
}

}  // namespace tfdude::simulation
