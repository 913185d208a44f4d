#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/transport/transport.hpp"
#include "tfdude/types/version.hpp"

#include "partition/messages.hpp"

namespace tfdude {

/// A participant that speaks another major version of the protocol: nothing is exchanged with it.
struct IncompatiblePeer {
  std::string partition;  ///< that it serves; empty: none
  ProtocolVersion protocol;
  std::string program;  ///< the version of its program
  Time since;           ///< when it was discovered, by the system's clock

  /// A sentence: its name, both versions, and what to do.
  [[nodiscard]] std::string text() const;
};

/// Handles the messages that a participant receives.
/// @par Thread safety  Called from the transport's threads, also at the same time; never after
///   Transport::stop() has returned. The handler may send and reply only from on_request(), and
///   must not wait for anything that arrives later.
class TransportHandler {
 public:
  virtual ~TransportHandler() = default;

  virtual void on_request(const PeerId& from, const Request& request) = 0;
  /// @param from  the partition whose owner has sent it
  virtual void on_reply(const std::string& from, const Reply& reply) = 0;
  virtual void on_update(const Update& update) = 0;
  virtual void on_joints(const JointUpdate& update) = 0;
  /// Values pushed to a group that is watched here.
  virtual void on_pushed(const PushedValues& pushed) = 0;
  /// One more watcher of a group can be reached: from now on pushed values arrive there.
  virtual void on_watcher(std::uint64_t) {}
  virtual void on_page(const Page& page) = 0;
  /// Whether pages are needed. Constant.
  [[nodiscard]] virtual bool wants_pages() const { return true; }
  /// Whether the time of external clocks is needed. Constant.
  [[nodiscard]] virtual bool wants_clock() const { return false; }
  /// The time of external clocks, as last published.
  virtual void on_clock(Time) {}
  /// Another participant's presence.
  virtual void on_presence(const Presence& presence) = 0;
  /// The participant that announced this partition has stopped or is lost.
  /// @param early  by how much later others may notice it
  virtual void on_lost(const std::string& partition, std::uint64_t incarnation,
                       std::chrono::nanoseconds early) = 0;
  /// Whether a frame is owned here: filters requests and updates. Must be quick and take no lock.
  [[nodiscard]] virtual bool owns(std::string_view id) const = 0;
  /// The same for a joint.
  [[nodiscard]] virtual bool owns_joint(std::string_view name) const = 0;
  /// Whether any joint is owned here. Constant while a partition is served.
  [[nodiscard]] virtual bool owns_joints() const { return true; }
};

/// Sends to one partition for a thread that must not wait. Created once, used by one thread at a
/// time. Must not be used after the transport has stopped.
template <class Message>
class Channel {
 public:
  virtual ~Channel() = default;

  /// Like Transport::send(), but at once or not at all. @return nothing if it was sent; kTimeout if
  /// the partition cannot be reached, or the message cannot be sent now; kNotPermitted; kTransport
  [[nodiscard]] virtual std::optional<Errc> try_send(const Message& message) = 0;
};

/// How participants reach each other, independent of any IPC.
///
/// Announced and published messages reach all participants, also those that join later. Requests
/// and updates reach the participant that serves the partition they are sent to. Replies reach the
/// peer that asked. Requests, replies and updates may be lost (a caller repeats them). Each page
/// and presence arrives, those of one sender in order; a later one may replace an earlier one of
/// the same page.
///
/// @par Thread safety  All functions are thread-safe.
class Transport {
 public:
  using Deadline = std::chrono::steady_clock::time_point;

  virtual ~Transport() = default;

  /// Joins: from now on the handler is called. It must outlive the transport.
  [[nodiscard]] virtual Result<void> start(TransportHandler& handler) = 0;

  /// Leaves; no handler is called after this returns. The destructor does it too.
  virtual void stop() = 0;

  /// Starts to receive the requests and updates for a partition.
  [[nodiscard]] virtual Result<void> serve(const std::string& partition) = 0;

  virtual void announce(const Presence& presence) = 0;
  virtual void publish(const Page& page) = 0;

  /// Starts to connect to a partition, without waiting, so that a later send() need not wait.
  virtual void prepare(const std::string& partition) = 0;

  /// Sends once the partition can be reached.
  /// @return kTimeout, naming the partition, at the deadline; kNotPermitted, naming also the
  ///   identity and what was tried, if the keys of this participant do not allow it
  [[nodiscard]] virtual Result<void> send(const std::string& partition, const Request& request,
                                          Deadline deadline) = 0;
  [[nodiscard]] virtual Result<void> send(const std::string& partition, const Update& update,
                                          Deadline deadline) = 0;

  [[nodiscard]] virtual Result<void> send(const std::string& partition, const JointUpdate& update,
                                          Deadline deadline) = 0;

  /// For messages of the same form: the first one allocates the memory for the rest. Starts to
  /// connect, as prepare() does. Never null.
  [[nodiscard]] virtual std::unique_ptr<Channel<Update>> update_channel(
      const std::string& partition) = 0;
  [[nodiscard]] virtual std::unique_ptr<Channel<JointUpdate>> joint_channel(
      const std::string& partition) = 0;

  /// Waits until the receivers have acknowledged all updates that were sent. An update that was
  /// overwritten by newer ones on its way counts as acknowledged, and so does one for a process
  /// that has left, or was lost and replaced by a later one.
  /// @return kTimeout or kUnreachable, naming a partition that has not acknowledged
  [[nodiscard]] virtual Result<void> flush(Deadline deadline) = 0;

  virtual void reply(const PeerId& to, const Reply& reply) = 0;

  /// Starts or stops receiving the values that an owner pushes to a group of watchers.
  /// @return also kNotPermitted
  [[nodiscard]] virtual Result<void> watch(const std::string& owner, std::uint64_t group) = 0;
  virtual void unwatch(std::uint64_t group) = 0;

  /// Sends to the watchers of the group (may be lost), or releases the resources for that.
  virtual void push(const PushedValues& pushed) = 0;
  virtual void end_pushing(std::uint64_t group) = 0;

  /// Sends the time to all participants that want the clock. May be lost; those that join later do
  /// not get it. @return kTransport, kNotPermitted
  [[nodiscard]] virtual Result<void> publish_clock(Time now) = 0;

  /// Whether the presence of all participants that were reachable when this one started should have
  /// arrived by now.
  [[nodiscard]] virtual bool discovered() const = 0;

  /// Whether a participant was discovered that has not announced yet which partition it serves.
  [[nodiscard]] virtual bool awaits_presence() const = 0;

  /// The owners of partitions that were discovered and cannot be understood.
  [[nodiscard]] virtual std::vector<IncompatiblePeer> incompatible() const { return {}; }

  /// The owners of partitions that were discovered, and with which nothing is exchanged because of
  /// keys: a sentence about each.
  [[nodiscard]] virtual std::vector<std::string> excluded() const { return {}; }

  /// How many messages of senders that took more than their share were dropped unread.
  [[nodiscard]] virtual std::uint64_t dropped() const { return 0; }

  /// How many datagrams were dropped because they are not what a participant sends.
  [[nodiscard]] virtual std::uint64_t refused_datagrams() const { return 0; }

  /// For how long a thread has been handling one message, if one is; the longest of all threads.
  [[nodiscard]] virtual std::chrono::nanoseconds busy_for() const { return {}; }

  /// As network_of(): which other processes of this computer discover the same participants. Empty:
  /// none, or only those that prove their rights by keys, or it cannot be told.
  [[nodiscard]] virtual std::string network() const { return {}; }

  /// Whether the owner of a partition was heard within the time after which it would count as lost
  /// if this participant depended on it.
  [[nodiscard]] virtual bool heard_lately(const std::string& /*partition*/) const { return true; }

  /// How long a new participant needs to discover all others, by experience.
  [[nodiscard]] virtual Milliseconds discovery_time() const = 0;
};

}  // namespace tfdude
