#include "partition/name_claim.hpp"

#include <algorithm>

namespace tfdude {

void NameClaim::hear(const Presence& presence) {
  if (presence.stopped) {
    rivals_.erase(key_of(presence));
  } else {
    rivals_[key_of(presence)] = presence;
  }
}

bool NameClaim::lost(std::uint64_t incarnation) {
  const std::size_t before = rivals_.size();
  for (auto rival = rivals_.begin(); rival != rivals_.end();) {
    rival = rival->second.incarnation == incarnation ? rivals_.erase(rival) : std::next(rival);
  }
  return rivals_.size() != before;
}

NameClaim::Turn NameClaim::to_take() const {
  const bool others = std::any_of(rivals_.begin(), rivals_.end(), [this](const auto& known) {
    const Presence& rival = known.second;
    return rival.serving || rival.taken || is_before(rival);
  });
  return others ? Turn::kOthers : Turn::kMine;
}

NameClaim::Turn NameClaim::to_serve() const {
  Turn turn = Turn::kMine;
  for (const auto& [key, rival] : rivals_) {
    if (rival.serving) return Turn::kOthers;
    if (!is_before(rival)) continue;
    if (rival.taken) return Turn::kOthers;
    turn = Turn::kWait;
  }
  return turn;
}

bool NameClaim::served() const {
  return std::any_of(rivals_.begin(), rivals_.end(),
                     [](const auto& known) { return known.second.serving; });
}

std::optional<Presence> NameClaim::rival() const {
  std::optional<Presence> first;
  for (const auto& [key, rival] : rivals_) {
    if (rival.serving || rival.taken) return rival;
    if (!first) first = rival;
  }
  return first;
}

}  // namespace tfdude
