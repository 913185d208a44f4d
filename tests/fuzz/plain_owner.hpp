#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "fuzz/plain_claims.hpp"
#include "partition/messages.hpp"

// The result that requests and claims of others must have at an owner, in the simplest
// implementation.
namespace tfdude::fuzz {

/// The Lamport time of a change that has none yet: later than all others.
inline constexpr std::uint64_t kJustNow = std::numeric_limits<std::uint64_t>::max();

/// The owner's frames.
class PlainOwner {
 public:
  struct Place {
    std::string parent;
    std::uint64_t lamport_time = 0;
  };
  using Places = std::map<std::string, Place>;

  explicit PlainOwner(std::string name) : name_(std::move(name)) {}

  /// What the owner reports of a frame that is no longer where it was.
  struct Word {
    Tombstone::Kind kind = Tombstone::Kind::kRemoved;
    std::string rival;
  };

  [[nodiscard]] const Places& places() const { return places_; }
  [[nodiscard]] bool holds(const std::string& id) const { return places_.count(id) != 0; }

  /// What is in force for this process, as long as it has nothing to yield.
  [[nodiscard]] Picture with(const Picture& others) const {
    Picture picture = others;
    for (const auto& [id, place] : places_) picture[id] = {name_, place.parent, place.lamport_time};
    return picture;
  }

  /// @return whether the request is granted
  bool answer(const Request& request, const Picture& others) {
    const Picture picture = without_cycles(with(others));
    if (const auto* add = std::get_if<AddRequest>(&request.body)) {
      if (picture.count(request.id) != 0 || !hangs(request.id, add->parent, picture)) return false;
      put(request.id, add->parent);
      return true;
    }
    if (const auto* move = std::get_if<MoveRequest>(&request.body)) {
      if (!holds(request.id) || !hangs(request.id, move->parent, picture)) return false;
      put(request.id, move->parent);
      return true;
    }
    if (const auto* update = std::get_if<UpdateRequest>(&request.body)) {
      return std::all_of(update->edges.begin(), update->edges.end(),
                         [this](const EdgeUpdate& edge) { return holds(edge.id); });
    }
    bool all = true;
    if (const auto* removal = std::get_if<RemoveRequest>(&request.body)) {
      for (const std::string& top : removal->tops) all = remove(top) && all;
    }
    return all;
  }

  /// A partition is silent for a moment: nothing is given up for it.
  void misses(const std::string& partition) { silent_.insert(partition); }
  void hears(const std::string& partition) { silent_.erase(partition); }
  void hears_all() { silent_.clear(); }

  /// A process that restarts leaves frames to partitions that serve them meanwhile.
  void returns(const Picture& others) {
    for (const auto& [id, theirs] : others) {
      if (places_.erase(id) != 0) words_[id] = {Tombstone::Kind::kYielded, theirs.owner};
    }
  }

  /// Gives up frames that others claim with more right.
  /// @param tombstones  what is new of what others removed
  void yield(const Picture& others, const std::vector<Tombstone>& tombstones) {
    yield_to(others);
    for (const std::string& id : orphans(others, tombstones)) (void)remove(id);
    // What was made a root is claimed later than by all others, which may bring the next cycle.
    while (make_root(others)) yield_to(others);
  }

  /// Takes over the Lamport times of what was changed just now, later than all that were known; all
  /// else is to be as it is here already.
  void demand_held(const Forest& forest, std::uint64_t latest) {
    std::size_t held = 0;
    for (const FrameInfo& frame : forest.frames()) {
      if (frame.owner != kHeldHere) continue;
      ++held;
      const auto mine = places_.find(frame.id);
      demand(mine != places_.end(), "what was given up is not held");
      demand(frame.parent == mine->second.parent, "what is held hangs where it was hung");
      if (mine->second.lamport_time == kJustNow) {
        demand(frame.lamport_time > latest, "a Lamport time is later than all that were known");
        mine->second.lamport_time = frame.lamport_time;
      }
      demand(frame.lamport_time == mine->second.lamport_time,
             "what did not change is as old as it was");
    }
    demand(held == places_.size(), "what was not given up is held");
  }

  /// Checks that this process's pages contain all frames, and tombstones for the others.
  void demand_told(const PlainLife& life) const {
    demand(life.claims.size() == places_.size(), "nothing is published but what is held");
    for (const auto& [id, place] : places_) {
      const auto claim = life.claims.find(id);
      demand(claim != life.claims.end(), "what is held is published");
      demand(
          claim->second.parent == place.parent && claim->second.lamport_time == place.lamport_time,
          "what is held is published as it is");
    }
    std::size_t tombstones = 0;
    for (const auto& [number, page] : life.pages) {
      for (const Tombstone& tombstone : page.tombstones) {
        ++tombstones;
        const auto word = words_.find(tombstone.id);
        demand(word != words_.end() && word->second.kind == tombstone.kind,
               "a tombstone says what happened");
        demand(tombstone.kind != Tombstone::Kind::kYielded || tombstone.rival == word->second.rival,
               "it names who was faster");
      }
    }
    demand(tombstones == words_.size(), "whatever goes leaves a tombstone");
  }

 private:
  [[nodiscard]] static bool hangs(const std::string& id, const std::string& parent,
                                  const Picture& picture) {
    if (parent.empty()) return true;
    if (picture.count(parent) == 0) return false;
    std::string at = parent;
    while (at != id && picture.count(at) != 0) at = picture.at(at).parent;
    return at != id;
  }

  void yield_to(const Picture& others) {
    for (const auto& [id, theirs] : others) {
      const auto mine = places_.find(id);
      if (mine == places_.end()) continue;
      if (silent_.count(theirs.owner) != 0) continue;
      if (!older(theirs, {name_, mine->second.parent, mine->second.lamport_time})) continue;
      places_.erase(mine);
      words_[id] = {Tombstone::Kind::kYielded, theirs.owner};
    }
  }

  bool make_root(const Picture& others) {
    const Picture picture = with(others);
    bool any = false;
    for (const auto& cycle : cycles_of(picture)) {
      const std::string youngest = youngest_of(cycle, picture);
      if (picture.at(youngest).owner != name_) continue;
      any = true;
      put(youngest, "");
      words_[youngest] = {Tombstone::Kind::kUnhung, ""};
    }
    return any;
  }

  [[nodiscard]] std::set<std::string> orphans(const Picture& others,
                                              const std::vector<Tombstone>& tombstones) const {
    std::set<std::string> ids;
    for (const Tombstone& tombstone : tombstones) {
      const bool there = holds(tombstone.id) || others.count(tombstone.id) != 0;
      if (tombstone.kind != Tombstone::Kind::kRemoved || there) continue;
      for (const auto& [id, place] : places_) {
        if (place.parent == tombstone.id && place.lamport_time < tombstone.lamport_time)
          ids.insert(id);
      }
    }
    return ids;
  }

  void put(const std::string& id, const std::string& parent) {
    places_[id] = {parent, kJustNow};
    words_.erase(id);
  }

  bool remove(const std::string& top) {
    if (places_.erase(top) == 0) return false;
    words_[top] = {Tombstone::Kind::kRemoved, ""};
    std::set<std::string> below;
    for (const auto& [id, place] : places_) {
      if (place.parent == top) below.insert(id);
    }
    for (const std::string& id : below) (void)remove(id);
    return true;
  }

  std::string name_;
  std::set<std::string> silent_;
  Places places_;
  std::map<std::string, Word> words_;
};

}  // namespace tfdude::fuzz
