#include "unit/partition/absences_world.hpp"

#include <algorithm>
#include <iterator>

#include "support/catch.hpp"
#include "support/forest_support.hpp"

namespace tfdude::testing {

AbsencesWorld::AbsencesWorld(Random& random, Counts& counts) : random_(random), counts_(counts) {
  spectator_.directory.changes().watch();
  for (std::size_t who = 0; who < kOwners; ++who) start(who, false);
}

void AbsencesWorld::step() {
  const std::size_t what = random_.index(40);
  const std::size_t who = random_.index(kOwners);
  if (what < 20) {
    deliver_one();
  } else if (what < 30) {
    if (serves(who)) change(who);
  } else if (what < 32) {
    if (serves(who)) end(who);
  } else if (what < 34) {
    if (serves(who)) hang(who);
  } else if (what < 35) {
    if (there(who)) blink(who);
  } else if (what < 37) {
    come_back(who);
  } else if (what < 39) {
    grow_late();
  } else if (!there(who)) {
    forget(who);
  }
}

void AbsencesWorld::run_until_quiet() {
  drain();
  grow_late();
}

void AbsencesWorld::demand_agreement() {
  for (std::size_t who = 0; who < kOwners; ++who) {
    if (!serves(who)) continue;
    INFO("owner " << who << " and the spectator");
    REQUIRE(lines_diff(owned_by_those_there(owners_[who]->replica),
                       owned_by_those_there(spectator_)) == "");
  }
  // A frame of a reachable owner does not belong to an unreachable one as well.
  for (std::size_t who = 0; who < kOwners; ++who) {
    if (!serves(who)) continue;
    for (const FrameInfo& frame : owners_[who]->replica.forest.frames()) {
      if (frame.owner != kHeldHere) continue;
      INFO("frame " << frame.id << " of " << name(who));
      REQUIRE(spectator_.directory.name(spectator_.forest.info(frame.id)->owner) == name(who));
    }
  }
}

void AbsencesWorld::return_all() {
  for (std::size_t who = 0; who < kOwners; ++who) come_back(who);
  run_until_quiet();
}

std::vector<std::string> AbsencesWorld::owned_by_those_there(const Replica& replica) const {
  std::vector<std::string> lines;
  for (const FrameInfo& frame : replica.forest.frames()) {
    const std::string& owner = replica.directory.name(frame.owner);
    const bool is_there = serves(static_cast<std::size_t>(owner.back() - '0'));
    if (is_there) lines.push_back(frame.id + " < " + frame.parent + " @ " + owner);
  }
  std::sort(lines.begin(), lines.end());
  return lines;
}

std::vector<FrameSpec> AbsencesWorld::some_free_frames() {
  std::vector<FrameSpec> frames;
  for (std::size_t i = 0; i < 2; ++i) {
    const std::string id = fought_frame(random_.index(kFrames));
    bool free = frames.empty() || frames.back().id != id;
    for (std::size_t who = 0; who < kOwners; ++who) {
      free = free && !(there(who) && owners_[who]->replica.forest.holds(id));
    }
    if (free) frames.push_back({id, "", along_x(1)});
  }
  return frames;
}

void AbsencesWorld::start(std::size_t who, bool configured) {
  configured_ = configured ? some_free_frames() : std::vector<FrameSpec>();
  // All serving owners are known, and all their messages were heard.
  auto owner = std::make_unique<LiveOwner>(name(who), ++lives_);
  for (std::size_t other = 0; other < kOwners; ++other) {
    if (!serves(other)) continue;
    owner->replica.directory.apply(owners_[other]->presence, now());
    for (const auto& [number, page] : owners_[other]->published) {
      owner->replica.directory.apply(page);
    }
  }
  owner->replica.directory.restore(absent_[who]);
  const auto state = stores_[who].load();
  REQUIRE(owner->partition.restore(*state, configured_, now()));
  owner->presence = presence_of(name(who), lives_, 0);
  owners_[who] = std::move(owner);
  publish(who);
}

// It dies, or ends in order.
void AbsencesWorld::end(std::size_t who) {
  const Presence last = owners_[who]->presence;
  const bool stopped = random_.index(3) == 0;
  absent_[who] = owners_[who]->replica.directory.absent();
  owners_[who].reset();
  for (auto queue = queues_.begin(); queue != queues_.end();) {
    if (!stopped && queue->first.first == who) lose(queue->second);
    const bool lost = queue->first.second == who || queue->second.empty();
    queue = lost ? queues_.erase(queue) : std::next(queue);
  }
  if (stopped) {
    Presence word = last;
    word.serving = false;
    word.stopped = true;
    say_to_all(who, word);
  } else {
    say_to_all(who, Silence{name(who), last.incarnation});
  }
}

// Messages on their way from an owner that dies. Silence is no message: participants that did not
// hear of the end notice the silence.
void AbsencesWorld::lose(std::deque<Said>& queue) {
  std::deque<Said> noticed;
  for (const Said& said : queue) {
    const auto* presence = std::get_if<Presence>(&said);
    if (std::holds_alternative<Silence>(said)) noticed.push_back(said);
    if (presence != nullptr && presence->stopped) {
      noticed.emplace_back(Silence{presence->partition, presence->incarnation});
    }
  }
  queue = std::move(noticed);
}

void AbsencesWorld::hang(std::size_t who) {
  owners_[who]->hangs = true;
  say_to_all(who, Silence{name(who), owners_[who]->presence.incarnation});
}

// Is silent for a moment.
void AbsencesWorld::blink(std::size_t who) {
  if (owners_[who]->hangs) return;
  say_to_all(who, Silence{name(who), owners_[who]->presence.incarnation});
  say_to_all(who, owners_[who]->presence);
}

void AbsencesWorld::come_back(std::size_t who) {
  if (serves(who)) return;
  run_until_quiet();
  const auto before = claims_of_others(who);
  const auto gone = removed_frames_of(who);
  const bool hung = there(who);
  if (hung) {
    owners_[who]->hangs = false;
    // It receives the messages of owners that came in the meantime, and they receive its own.
    for (std::size_t other = 0; other < kOwners; ++other) {
      if (other == who || !serves(other)) continue;
      say({other, who}, owners_[other]->presence);
      for (const auto& [number, page] : owners_[other]->published) say({other, who}, page);
      for (const auto& [number, page] : owners_[who]->published) say({who, other}, page);
    }
    say_to_all(who, owners_[who]->presence);
  } else {
    start(who, random_.index(2) == 0);
  }
  const std::vector<FrameSpec> configured = hung ? std::vector<FrameSpec>() : configured_;
  drain();
  for (const std::string& id : gone) {
    const bool added = std::any_of(configured.begin(), configured.end(),
                                   [&](const FrameSpec& frame) { return frame.id == id; });
    if (added) continue;
    INFO("removed frame " << id << " of " << name(who) << (hung ? ", which hung" : ""));
    REQUIRE_FALSE(spectator_.forest.exists(id));
    ++counts_.removed;
  }
  for (const auto& [id, owner] : before) {
    // A partition that hung yields only to owners that know of its absence.
    if (hung && knew_.count(owner) == 0) continue;
    INFO("frame " << id << " of " << name(owner) << ", and " << name(who)
                  << (hung ? " hung" : " was dead"));
    REQUIRE(owners_[owner]->replica.forest.holds(id));
    ++counts_.kept;
  }
  knew_.clear();
}

std::vector<std::pair<std::string, std::size_t>> AbsencesWorld::claims_of_others(std::size_t who) {
  const auto theirs = claimed_by(who);
  std::vector<std::pair<std::string, std::size_t>> claims;
  for (std::size_t other = 0; other < kOwners; ++other) {
    if (other == who || !serves(other)) continue;
    // If both report the other as lost, the older claim wins.
    const bool mutual = there(who) && misses(who, other);
    if (misses(other, who) && !mutual) knew_.insert(other);
    for (const auto& [id, lamport_time] : theirs) {
      // Only roots: a frame below a removed one may disappear for another reason.
      const auto info = owners_[other]->replica.forest.info(id);
      if (info && info->owner == kHeldHere && info->parent.empty()) claims.emplace_back(id, other);
    }
  }
  return claims;
}

std::map<std::string, std::uint64_t> AbsencesWorld::claimed_by(std::size_t who) {
  std::map<std::string, std::uint64_t> claims;
  if (there(who)) {
    for (const FrameInfo& frame : owners_[who]->replica.forest.frames()) {
      if (frame.owner == kHeldHere) claims.emplace(frame.id, frame.lamport_time);
    }
    return claims;
  }
  const StoredState stored = *stores_[who].load();
  for (const StoredFrame& frame : stored.frames) claims.emplace(frame.id, frame.lamport_time);
  return claims;
}

std::set<std::string> AbsencesWorld::removed_frames_of(std::size_t who) {
  std::set<std::string> removed;
  const auto claims = claimed_by(who);
  for (std::size_t other = 0; other < kOwners; ++other) {
    const bool knows = other != who && serves(other) && misses(other, who);
    if (!knows || (there(who) && misses(who, other))) continue;
    for (const auto& [number, page] : owners_[other]->published) {
      for (const Tombstone& one : page.tombstones) {
        const auto claim = claims.find(one.id);
        const bool ends = one.kind == Tombstone::Kind::kRemoved && claim != claims.end() &&
                          claim->second < one.lamport_time;
        if (ends && !spectator_.forest.exists(one.id)) removed.insert(one.id);
      }
    }
  }
  return removed;
}

bool AbsencesWorld::misses(std::size_t who, std::size_t whom) const {
  const auto absent = owners_[who]->replica.directory.absent();
  return std::any_of(absent.begin(), absent.end(), [&](const Absent& one) {
    return one.partition == name(whom) && Absences::outlived(one.kind);
  });
}

void AbsencesWorld::forget(std::size_t who) {
  run_until_quiet();
  std::size_t asked = 0;
  for (std::size_t other = 0; other < kOwners; ++other) {
    if (!serves(other) || random_.index(3) == 0) continue;
    const Reply reply = owners_[other]->partition.answer(
        Request{0, name(other), ForgetRequest{name(who), last_life_[who]}}, now());
    REQUIRE(std::holds_alternative<Done>(reply.body));
    publish(other);
    ++asked;
  }
  if (asked == 0) return;
  drain();
  ++counts_.forgotten;
  for (std::size_t other = 0; other <= kOwners; ++other) {
    if (other < kOwners && !serves(other)) continue;
    INFO("of " << name(who) << " nothing is kept at " << other);
    REQUIRE_FALSE(replica(other).directory.owner(name(who)));
    for (const FrameInfo& frame : replica(other).forest.frames()) {
      REQUIRE(replica(other).directory.name(frame.owner) != name(who));
    }
  }
}

void AbsencesWorld::publish(std::size_t who) {
  LiveOwner& owner = *owners_[who];
  for (const Change& one : owner.replica.directory.changes().take()) {
    counts_.conflicts += one.kind == ChangeKind::kConflict ? 1 : 0;
  }
  REQUIRE(stores_[who].save(testing::unsaved(owner.partition)));
  const auto pages = owner.partition.take_pages();
  for (const Page& page : pages) owner.published[page.number] = page;
  Presence presence = owner.presence;
  presence.pages = owner.partition.page_count();
  presence.absent = owner.replica.directory.absent();
  last_life_[who] = presence.incarnation;
  const bool changed = !(presence == owner.presence) || !std::exchange(owner.announced, true);
  owner.presence = presence;
  for (std::size_t hearer = 0; hearer <= kOwners; ++hearer) {
    if (hearer == who || (hearer < kOwners && !there(hearer))) continue;
    for (const Page& page : pages) say({who, hearer}, page);
    if (changed) say({who, hearer}, presence);
  }
}

void AbsencesWorld::say_to_all(std::size_t who, const Said& said) {
  for (std::size_t hearer = 0; hearer <= kOwners; ++hearer) {
    if (hearer != who && (hearer == kSpectator || there(hearer))) say({who, hearer}, said);
  }
}

void AbsencesWorld::change(std::size_t who) {
  LiveOwner& owner = *owners_[who];
  const Request request = any_change(random_, owner.replica.forest, kFrames);
  (void)owner.partition.answer(request, now());
  publish(who);
}

bool AbsencesWorld::deliver_one() {
  std::vector<Way> ways;
  for (const auto& [way, said] : queues_) {
    if (!deaf(way.second)) ways.push_back(way);
  }
  if (ways.empty()) return false;
  const auto queue = queues_.find(ways[random_.index(ways.size())]);
  const std::size_t hearer = queue->first.second;
  const Said said = std::move(queue->second.front());
  queue->second.pop_front();
  if (queue->second.empty()) queues_.erase(queue);
  Directory& directory = replica(hearer).directory;
  if (const auto* page = std::get_if<Page>(&said)) directory.apply(*page);
  if (const auto* presence = std::get_if<Presence>(&said)) directory.apply(*presence, now());
  if (const auto* silence = std::get_if<Silence>(&said)) {
    (void)directory.lost(silence->partition, silence->incarnation, now());
  }
  (void)directory.look_for_gone(steady_);
  heard(hearer);
  return true;
}

void AbsencesWorld::heard(std::size_t hearer) {
  if (hearer == kSpectator) {
    for (const Change& one : spectator_.directory.changes().take()) {
      counts_.inherited += one.kind == ChangeKind::kFrameTakenOver ? 1 : 0;
    }
    return;
  }
  // Others have forgotten it although it only hung: it continues as a later process.
  LiveOwner& owner = *owners_[hearer];
  if (owner.replica.directory.hidden_by(owner.presence.incarnation)) {
    owner.presence.incarnation = ++lives_;
    owner.partition.overtake(lives_);
  }
  // Before anything is given up, the others must have reported all their pages.
  const bool all_heard = std::none_of(queues_.begin(), queues_.end(), [&](const auto& queue) {
    return queue.first.second == hearer;
  });
  Partition& partition = owners_[hearer]->partition;
  while (all_heard && partition.yield(partition.pending_yields(), now())) {
  }
  publish(hearer);
}

// An owner may also have to give up its own changes.
void AbsencesWorld::drain() {
  do {
    while (deliver_one()) {
    }
    for (std::size_t who = 0; who < kOwners; ++who) {
      if (serves(who)) heard(who);
    }
  } while (deliver_one());
}

void AbsencesWorld::grow_late() {
  for (int part = 0; part < 4; ++part) {
    if (part > 0) steady_ += Absences::kGrace / 2;
    for (std::size_t who = 0; who <= kOwners; ++who) {
      if (deaf(who)) continue;
      if (replica(who).directory.look_for_gone(steady_)) heard(who);
    }
  }
  drain();
}

}  // namespace tfdude::testing
