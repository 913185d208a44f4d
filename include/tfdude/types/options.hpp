#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "tfdude/base/export.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/types/edge.hpp"

namespace tfdude {

/// A profile that is no file: the built-in one, confined to this computer (UDP over 127.0.0.1).
inline constexpr const char* kLocalProfile = "local";

/// A domain that nobody can join: TFDUDE_DOMAIN is no number.
inline constexpr std::uint32_t kNoDomain = UINT32_MAX;

/// What TFDUDE_DOMAIN says in the environment, else 0; kNoDomain, which open() refuses, where it is no number.
[[nodiscard]] TFDUDE_EXPORT std::uint32_t domain_of_environment();
/// What TFDUDE_PROFILE says in the environment, else empty.
[[nodiscard]] TFDUDE_EXPORT std::string profile_of_environment();

/// How a participant joins. Participants discover each other only in the same domain and with the same profile.
struct Options {
  /// DDS domain, 0 to 232.
  std::uint32_t domain = domain_of_environment();
  /// XML file of DDS profiles, or kLocalProfile; empty: the built-in ones, which use all network interfaces.
  std::string profile = profile_of_environment();
  /// HOST:PORT of a Fast DDS discovery server with id 0; empty: participants meet by multicast
  std::string discovery_server;
  Milliseconds timeout{1000};  ///< how long a call may take, see Client
  /// How long a new participant looks round at most before it says that a frame is not there. It waits this long only where
  /// it meets nobody. Of others that it has met or heard of, and that are slow to tell what they own, calls say kTimeout,
  /// until three time-outs later.
  Milliseconds discovery{1000};
  /// Directory in which a Node keeps its partition's frames, so that its next process has them back; empty:
  /// it keeps nothing. What others change by request is stored before they are answered.
  std::string state;
  /// Whether what is stored survives a loss of power, too: each change then waits until the disk has it. Else such a loss may
  /// cost the last changes, though they were acknowledged; the end of the process costs none.
  bool sync = false;
  /// How often at most values that were streamed, or set by the Node's own process, are stored.
  Milliseconds save_every{1000};
  /// How much is kept of the history of a Node's edges, where a frame says nothing else.
  EdgeTiming history{};
  /// How long the end of a client waits until what it has streamed (publish, publish_joints) is acknowledged, as flush();
  /// no longer than `timeout`.
  Milliseconds linger{100};
};

/// How a path is watched.
struct WatchOptions {
  /// How often at most an owner sends what has changed [Hz]: from once an hour to 1e6; 0: every sample.
  double rate = 0;
  /// One composed transform for each partition on the path instead of all its edges: fewer bytes, but between samples the
  /// segment is interpolated as a whole.
  bool composed = false;
  /// How much history is kept here. Process noise is that of the edge's owner, where it has one.
  EdgeTiming timing{};
  /// Called when the path has found another way, or why there is none for now: one call at a time, from a thread of
  /// the library's that holds no lock, so that it may call anything, watch() as well. Must not throw.
  std::function<void(const std::string& what)> on_route;
};

}  // namespace tfdude
