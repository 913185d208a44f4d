#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "partition/absences.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/replica.hpp"

namespace tfdude::testing {

inline constexpr Time kNow{std::chrono::seconds(100)};
inline constexpr Absences::Steady kStart{};

inline Page page_of(const std::string& partition, std::vector<PageEntry> entries,
                    std::uint64_t incarnation = 1) {
  return {partition, 0, incarnation, incarnation + 1, std::move(entries)};
}

// A participant that knows two claims to "hand". That of "arm" is the older one.
struct Witness : Replica {
  explicit Witness(const std::string& own = "base") : Replica(own) {
    directory.changes().watch();
    hear("arm", 1, 10);
  }
  void hear(const std::string& partition, std::uint64_t incarnation, std::uint64_t lamport_time,
            std::vector<Absent> absent = {}) {
    Presence presence = presence_of(partition, incarnation, 1);
    presence.absent = std::move(absent);
    directory.apply(presence, kNow);
    directory.apply(page_of(partition, {{"hand", "", lamport_time}}, incarnation));
  }
  void lose(const std::string& partition, std::uint64_t incarnation) {
    CHECK(directory.lost(partition, incarnation, kNow));
    (void)directory.look_for_gone(kStart);
  }
  void wait() {
    CHECK_FALSE(directory.look_for_gone(kStart + Absences::kGrace / 2));
    CHECK(directory.look_for_gone(kStart + Absences::kGrace));
    CHECK(directory.look_for_gone(kStart + Absences::kTakeover));
  }
  std::string owner_of(const std::string& id) const {
    const auto frame = forest.info(id);
    return frame ? directory.name(frame->owner) : "nobody";
  }
  std::vector<std::string> told(ChangeKind kind) {
    std::vector<std::string> messages;
    for (const Change& one : directory.changes().take()) {
      if (one.kind == kind) messages.push_back(one.message);
    }
    return messages;
  }
};

}  // namespace tfdude::testing
