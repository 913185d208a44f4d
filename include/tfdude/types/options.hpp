#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/types/edge.hpp"

namespace tfdude {

/// A built-in profile instead of a file: this computer only (UDP over 127.0.0.1).
inline constexpr const char* kLocalProfile = "local";

/// A domain that nobody can join: TFDUDE_DOMAIN is not a number.
inline constexpr std::uint32_t kNoDomain = UINT32_MAX;

/// The domain in the environment's TFDUDE_DOMAIN, else 0. If that is not a number, kNoDomain, which
/// open() rejects.
[[nodiscard]] TFDUDE_EXPORT std::uint32_t domain_of_environment();
/// The profile in the environment's TFDUDE_PROFILE, else empty.
[[nodiscard]] TFDUDE_EXPORT std::string profile_of_environment();
/// The directory of keys in the environment's TFDUDE_KEYS, else empty.
[[nodiscard]] TFDUDE_EXPORT std::string keys_of_environment();
/// False if the environment's TFDUDE_SHARED_MEMORY is "off", "false", "no" or "0".
[[nodiscard]] TFDUDE_EXPORT bool shared_memory_of_environment();

/// How much others can make a Node keep. What would exceed it is rejected with kTooMuch, except
/// samples.
struct PartitionLimits {
  std::size_t frames = 200'000;  ///< that the partition owns
  /// Groups of watchers. Those that watch the same edges of the partition in the same way are one.
  std::size_t watches = 1000;
  /// Of the samples of all its edges. The oldest ones are dropped for new ones, and counted
  /// (Node::refused()); the two newest of each edge stay.
  std::size_t history_bytes = std::size_t{256} << 20U;
};

/// How a participant joins a domain, a Client or a Node. Participants discover each other only in
/// the same domain and with the same profile.
struct Options {
  /// DDS domain, 0 to 232.
  std::uint32_t domain = domain_of_environment();
  /// XML file of DDS profiles, or kLocalProfile; empty: the built-in ones, which use all network
  /// interfaces.
  std::string profile = profile_of_environment();
  /// HOST:PORT of a Fast DDS discovery server with id 0; empty: discovery by multicast.
  std::string discovery_server;
  /// Directory of an identity, made by `tfdude keys`; empty: no keys. All participants need keys of
  /// the same authority, or none has any.
  std::string keys = keys_of_environment();
  Milliseconds timeout{1000};  ///< time limit of a call, see Client
  /// Maximum time that a new participant searches for others before it reports a frame as unknown.
  /// The whole time passes only if it discovers nobody. If it has discovered a participant that has
  /// not announced its structure, calls fail with kTimeout, for up to three times Options::timeout
  /// more.
  Milliseconds discovery{1000};
  /// The clock of stamps: of unstamped updates of a Node's dynamic edges, of the check how far a
  /// stamp is ahead, and of Client::now(). Liveness and time limits always use a steady clock, and
  /// events, logs and conflicts between partitions the system's clock. An external clock gets its
  /// time from Client::publish_clock() of any participant of the domain, or from
  /// Client::set_time(). All participants of a domain should have the same kind.
  ClockKind clock = ClockKind::kSystem;
  /// How many frames, joints and latest removals of all other partitions are kept. What is beyond
  /// is not, and its partitions stay incomplete here.
  std::size_t others = 2'000'000;
  /// Maximum time that the destructor of a client waits until the values it has streamed (publish,
  /// publish_joints) are acknowledged, as flush() does; at most `timeout`.
  Milliseconds linger{100};
  /// Whether lookups read frames of other processes of this computer in the memory of those, and
  /// those read a Node's frames in its memory (docs/memory.md). Where that is not possible, owners
  /// are asked over DDS.
  bool shared_memory = shared_memory_of_environment();
};

struct NodeOptions;

/// How a Client joins a domain.
struct ClientOptions : Options {
  ClientOptions() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): what all participants have is enough
  ClientOptions(Options common) : Options(std::move(common)) {}
  ClientOptions(const NodeOptions&) = delete;

  /// What a client follows, instead of all frames. Absent: it receives the structure of all
  /// partitions, and keeps it. Otherwise it has no replica, and keeps only the frames that it
  /// follows or has been asked about, each with all frames above it. An entry is the id of a frame,
  /// for it and all frames below it; or the beginning of ids, followed by '*'. No entries: it only
  /// asks.
  ///
  /// Such a client asks an owner, which has a replica, for frames, and keeps the answers. So
  /// the first call about a frame takes one more round trip. If a call fails with a kept answer, it
  /// asks again. find(), path(), parent() and exists() ask each time, and so does frames(), which
  /// lists what is followed and all frames above. A watched path takes a new route, and publish()
  /// notices a new owner, up to a second after the change. remove(), children(), roots(), and all
  /// that moves joints or opens streams fail with kInvalidInput, because they need all frames.
  /// partitions() gives no numbers of frames; on_change() reports partitions only. Every function
  /// may also fail with kUnsupported (all owners are of an earlier version) or kNotPermitted
  /// (keys).
  std::optional<std::vector<std::string>> follow{};
};

/// How a Node joins a domain, and how it keeps and serves its partition.
struct NodeOptions : Options {
  NodeOptions() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): what all participants have is enough
  NodeOptions(Options common) : Options(std::move(common)) {}
  NodeOptions(const ClientOptions&) = delete;

  /// Directory in which a Node stores its partition's frames, from which its next process restores
  /// them; empty: nothing is stored. Changes requested by others are stored before they are
  /// acknowledged.
  std::string state;
  /// Whether stored changes also survive a power failure: each change then waits for the disk. If
  /// false, a power failure may lose the last acknowledged changes; the end of the process loses
  /// none.
  bool sync = false;
  /// Values that were streamed, or set by the Node's own process, are stored with the next other
  /// change, or at this interval.
  Milliseconds save_every{1000};
  /// Default timing and history of a Node's edges, for frames without their own.
  EdgeTiming history{};
  /// The robot description (URDF) of a Node's partition, which others can ask for. It is only
  /// passed on: the frames are those given to Node::open().
  std::string description;
  PartitionLimits limits{};
};

/// How to watch a path.
struct WatchOptions {
  /// Maximum rate at which an owner sends changes [Hz]: from once an hour to 1e6; 0: every sample.
  double rate = 0;
  /// Send one composed transform for each partition on the path instead of all its edges: fewer
  /// bytes, but the segment is interpolated as a whole between samples, where its covariance is a
  /// bound. kInvalidInput if it has process noise.
  bool composed = false;
  /// How much history is kept here. A path that is read in the memory of its owners has theirs, so
  /// one for which more than the default is asked is not read there. Process noise is taken from
  /// the edge's owner, if it has one.
  EdgeTiming timing{};
  /// Called when the route of the path has changed, or with the reason why there is none for now.
  /// One call at a time, from a library thread that holds no lock: it may call any function, also
  /// watch(). Must not throw. A call that has begun may outlast the last PathWatch of the path, but
  /// not the client's destructor.
  std::function<void(const std::string& what)> on_route;
};

}  // namespace tfdude
