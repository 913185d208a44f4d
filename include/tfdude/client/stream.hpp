#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/math/transform.hpp"
#include "tfdude/types/not_sent.hpp"

namespace tfdude {

struct Update;
struct JointUpdate;
template <class Message>
class Sender;

/// Streams values of edges from a real-time thread, as Client::publish() does, but never waits: neither until participants
/// have met, nor for an owner, nor for another thread of this process that plans, receives or changes the structure. Where the
/// owners are is followed by a thread of the library's, so that a stream goes on by itself when an owner restarts, or an edge
/// moves to another. It may outlive its Client, and then sends nothing any more.
///
/// @par Bound  try_publish() takes a time proportional to the number of edges and of owners, and one write of the transport
///   an owner: with Fast DDS a synchronous one, which locks that writer and calls the system's send. Up to there nothing is
///   allocated and no lock is taken that somebody else may hold, while no value is refused; what is allocated below that is said
///   in docs/realtime.md. Edges that this process owns are written as by Client::update(), under the lock of the writers of
///   its forest. The loopback transport calls the owner.
/// @par Thread safety  Each stream is of one thread at a time; a thread may have many, and several streams may have the same
///   edges.
class TFDUDE_EXPORT EdgeStream {
 public:
  explicit EdgeStream(std::shared_ptr<Sender<Update>> sender);
  EdgeStream(EdgeStream&&) noexcept;
  EdgeStream& operator=(EdgeStream&&) noexcept;
  EdgeStream(const EdgeStream&) = delete;
  EdgeStream& operator=(const EdgeStream&) = delete;
  ~EdgeStream();

  /// Sends each owner its share, as one, or not at all. Where a value is invalid nothing is sent, and only those that are
  /// invalid are listed. Without a stamp each owner takes the time of arrival, as for publish().
  /// @param X_PC  one an edge, as the stream was opened
  /// @return what was not sent, in no particular order; empty: all was handed to the transport, which is not to say that it has arrived (flush()).
  ///   Valid until the next call.
  [[nodiscard]] const std::vector<NotSent>& try_publish(const std::vector<Transform>& X_PC,
                                                        std::optional<Time> stamp = std::nullopt);

 private:
  std::shared_ptr<Sender<Update>> sender_;
};

/// The same for positions of joints, as Client::publish_joints() does. A joint that several partitions have is listed where one of
/// them was not sent it. Joints of this process's own partition are applied under the lock that those share with the
/// threads that receive: where it is taken, that share fails with kTimeout instead of waiting.
class TFDUDE_EXPORT JointStream {
 public:
  explicit JointStream(std::shared_ptr<Sender<JointUpdate>> sender);
  JointStream(JointStream&&) noexcept;
  JointStream& operator=(JointStream&&) noexcept;
  JointStream(const JointStream&) = delete;
  JointStream& operator=(const JointStream&) = delete;
  ~JointStream();

  /// As EdgeStream::try_publish().
  /// @param positions  one a joint, as the stream was opened [rad or m]
  /// @param variances  of these [rad² or m²]
  [[nodiscard]] const std::vector<NotSent>& try_publish(const std::vector<double>& positions,
                                                        const std::vector<double>& variances,
                                                        std::optional<Time> stamp = std::nullopt);

 private:
  std::shared_ptr<Sender<JointUpdate>> sender_;
};

}  // namespace tfdude
