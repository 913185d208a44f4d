#pragma once

#include <algorithm>
#include <cstddef>

#include "partition/messages.hpp"

namespace tfdude {

/// How many of what several participants have begun here are of one of them.
/// @param begun  a map whose keys are pairs that begin with the participant
template <class Begun>
[[nodiscard]] std::size_t count_of(const Begun& begun, const PeerId& from) {
  return static_cast<std::size_t>(std::count_if(
      begun.begin(), begun.end(), [&](const auto& one) { return one.first.first == from; }));
}

/// Makes room for the first one of a participant, if there are `most`: the one not heard for
/// longest goes, of participants that have several.
/// @return false: there is no room
template <class Begun>
[[nodiscard]] bool make_room_for(Begun& begun, const PeerId& from, std::size_t most) {
  if (begun.size() < most) return true;
  auto least = begun.end();
  for (auto one = begun.begin(); one != begun.end(); ++one) {
    const bool more = count_of(begun, one->first.first) > 1;
    if (more && (least == begun.end() || one->second.heard < least->second.heard)) least = one;
  }
  if (count_of(begun, from) > 0 || least == begun.end()) return false;
  begun.erase(least);
  return true;
}

}  // namespace tfdude
