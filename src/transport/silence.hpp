#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

namespace tfdude {

/// When a server was heard, and since when this participant depends on it.
struct Hearing {
  using Time = std::chrono::steady_clock::time_point;

  Time last{};
  std::optional<Time> needed_since{};
  Time asked{};          ///< when it was last asked for a sign of life
  bool present = false;  ///< its presence has come
  bool replied = false;  ///< it is known to receive requests

  /// This participant looks so much later than planned: it was prevented from receiving, too.
  void pass_over(Time::duration late) {
    last += late;
    if (needed_since) *needed_since += late;
  }
  void need(bool needed, Time now) {
    if (!needed) needed_since.reset();
    if (needed && !needed_since) needed_since = now;
  }
};

/// How long a server may be silent before it counts as lost.
struct Patience {
  std::chrono::nanoseconds needed;  ///< one that is needed, and has replied before
  std::chrono::nanoseconds others;  ///< any other; before its first reply, DDS may be matching it
  std::chrono::nanoseconds first;   ///< one whose presence has not come yet
  /// How often participants look at the latest.
  std::chrono::nanoseconds look_every;
};

/// What a silence means.
struct Silence {
  enum class Kind : std::uint8_t {
    kNone,
    kAsk,   ///< the server is needed: it must be asked for a sign of life
    kLost,  ///< it counts as lost
  };
  Kind kind = Kind::kNone;
  /// Of a loss: by how much later those may notice it that do not need the server.
  std::chrono::nanoseconds early{};
};

/// A server that is needed and was not heard for this long is asked for a sign of life.
inline constexpr std::chrono::milliseconds kProbeAfter{100};

/// Judges a server that did not count as lost before. One that is needed is asked, so it is lost
/// earlier; this silence begins when it is needed. One that has not replied yet is asked even if it
/// is heard: acknowledgements of a stream do not show that it receives requests.
[[nodiscard]] inline Silence judge(const Hearing& heard, const Patience& patience,
                                   Hearing::Time now) {
  const bool needed = heard.needed_since.has_value();
  const auto quiet = now - std::max(heard.last, heard.needed_since.value_or(heard.last));
  const auto silent = now - heard.last;
  const bool gave_no_answer = needed && heard.replied && quiet >= patience.needed;
  if (gave_no_answer || silent >= (heard.present ? patience.others : patience.first)) {
    const auto early = patience.others + patience.look_every - silent;
    return {Silence::Kind::kLost, std::max<std::chrono::nanoseconds>(early, {})};
  }
  const auto unasked = now - std::max(heard.asked, heard.needed_since.value_or(now));
  const bool ask = quiet >= kProbeAfter || (!heard.replied && unasked >= kProbeAfter);
  return {needed && ask ? Silence::Kind::kAsk : Silence::Kind::kNone, {}};
}

}  // namespace tfdude
