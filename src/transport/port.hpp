#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/transport/transport.hpp"

#include "partition/messages.hpp"

namespace tfdude {

/// What a participant does with what arrives.
/// @par Thread safety  Called from the transport's threads, also at the same time; never after
///   Transport::stop() has returned. The handler may send and reply from on_request() only, and must not
///   wait for anything that arrives later.
class TransportHandler {
 public:
  virtual ~TransportHandler() = default;

  virtual void on_request(const PeerId& from, const Request& request) = 0;
  virtual void on_reply(const Reply& reply) = 0;
  virtual void on_update(const Update& update) = 0;
  virtual void on_joints(const JointUpdate& update) = 0;
  /// Of a group that is watched.
  virtual void on_pushed(const PushedValues& pushed) = 0;
  /// Somebody more can be reached who watches a group: from now on all that is pushed arrives there.
  virtual void on_watcher(std::uint64_t) {}
  virtual void on_page(const Page& page) = 0;
  /// Another participant's presence.
  virtual void on_presence(const Presence& presence) = 0;
  /// The participant that announced this partition has gone, orderly or not.
  virtual void on_lost(const std::string& partition, std::uint64_t incarnation) = 0;
  /// Whether a frame is held here: the filter before requests and updates. Must be quick and take no lock.
  [[nodiscard]] virtual bool owns(std::string_view id) const = 0;
  /// The same of a joint.
  [[nodiscard]] virtual bool owns_joint(std::string_view name) const = 0;
};

/// A way to one partition for a thread that must not wait; found once, used by one thread at a time. Not used any more when the
/// transport stops.
template <class Message>
class Channel {
 public:
  virtual ~Channel() = default;

  /// As Transport::send(), at once or not at all. @return false where nobody is there to take it, or it is not taken now
  [[nodiscard]] virtual bool try_send(const Message& message) = 0;
};

/// How participants reach each other; free of any IPC's words.
///
/// What is announced and published reaches all participants, also those that join later. Requests and
/// updates reach the participant that serves the partition they are sent to, and replies the peer that
/// asked. Requests, replies and updates may be lost (a caller repeats); each page and presence arrives,
/// those of one sender in order, a later one possibly instead of an earlier one of the same page.
///
/// @par Thread safety  All functions may be called from any thread.
class Transport {
 public:
  using Deadline = std::chrono::steady_clock::time_point;

  virtual ~Transport() = default;

  /// Joins: from now on the handler, which outlives the transport, is called.
  [[nodiscard]] virtual Result<void> start(TransportHandler& handler) = 0;

  /// Leaves; no handler is called after this returns. The destructor does it too.
  virtual void stop() = 0;

  /// Starts to receive the requests and updates for a partition.
  [[nodiscard]] virtual Result<void> serve(const std::string& partition) = 0;

  virtual void announce(const Presence& presence) = 0;
  virtual void publish(const Page& page) = 0;

  /// Begins to connect to a partition, without waiting, so that a later send() need not.
  virtual void prepare(const std::string& partition) = 0;

  /// Sends once the partition can be reached. @return kTimeout, naming the partition, at the deadline.
  [[nodiscard]] virtual Result<void> send(const std::string& partition, const Request& request,
                                          Deadline deadline) = 0;
  [[nodiscard]] virtual Result<void> send(const std::string& partition, const Update& update,
                                          Deadline deadline) = 0;

  [[nodiscard]] virtual Result<void> send(const std::string& partition, const JointUpdate& update,
                                          Deadline deadline) = 0;

  /// For messages that are alike, of which the first makes room for the rest. Begins to connect, as prepare(); never null.
  [[nodiscard]] virtual std::unique_ptr<Channel<Update>> update_channel(
      const std::string& partition) = 0;
  [[nodiscard]] virtual std::unique_ptr<Channel<JointUpdate>> joint_channel(
      const std::string& partition) = 0;

  /// Waits until all updates that were sent have been acknowledged by those to whom they went. @return kTimeout or
  ///   kUnreachable, naming one who has not; what was overwritten by younger updates on its way counts as acknowledged.
  [[nodiscard]] virtual Result<void> flush(Deadline deadline) = 0;

  virtual void reply(const PeerId& to, const Reply& reply) = 0;

  /// Starts to receive what is pushed to a group of watchers, or ends that.
  [[nodiscard]] virtual Result<void> watch(std::uint64_t group) = 0;
  virtual void unwatch(std::uint64_t group) = 0;

  /// Sends to those who watch the group, or gives back what was needed for that. May be lost.
  virtual void push(const PushedValues& pushed) = 0;
  virtual void end_pushing(std::uint64_t group) = 0;

  /// Whether the presence of all who were there when this participant started should have come by now.
  [[nodiscard]] virtual bool discovered() const = 0;

  /// Whether somebody was met who has not said yet which partition it serves.
  [[nodiscard]] virtual bool awaits_presence() const = 0;

  /// How long a new participant needs to meet all others, by experience.
  [[nodiscard]] virtual Milliseconds discovery_time() const = 0;
};

}  // namespace tfdude
