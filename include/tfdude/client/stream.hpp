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

/// Streams edge values from a real-time thread, as Client::publish() does, but never waits: not for
/// discovery, not for an owner, and not for another thread of this process that plans, receives or
/// changes the structure. A library thread tracks the owners, so a stream continues by itself when
/// an owner restarts or an edge gets another owner. A stream may outlive its Client, but then sends
/// nothing.
///
/// @par Bound  try_publish() takes time proportional to the number of edges and owners, plus one
///   write of the transport per owner. With Fast DDS the write is synchronous: it locks the writer
///   and calls the operating system's send. Above the write, and while no value is rejected,
///   nothing is allocated and no lock is taken that another thread may hold; docs/realtime.md
///   describes what the write itself allocates. Edges of this process are written as by
///   Client::update(), under the writers' lock of its forest. The loopback transport calls the
///   owner directly.
/// @par Thread safety  Each stream may be used by one thread at a time. A thread may have many
///   streams, and several streams may have the same edges.
class TFDUDE_EXPORT EdgeStream {
 public:
  explicit EdgeStream(std::shared_ptr<Sender<Update>> sender);
  EdgeStream(EdgeStream&&) noexcept;
  EdgeStream& operator=(EdgeStream&&) noexcept;
  EdgeStream(const EdgeStream&) = delete;
  EdgeStream& operator=(const EdgeStream&) = delete;
  ~EdgeStream();

  /// Sends each owner its whole share or nothing. If a value is invalid, nothing is sent and only
  /// the invalid values are listed. Without a stamp each owner uses the time of arrival, as for
  /// publish().
  /// @param X_PC  one per edge, in the order in which the stream was opened
  /// @return what was not sent, in no particular order. Empty: everything was handed to the
  ///   transport, but has not necessarily arrived (flush()). Valid until the next call.
  [[nodiscard]] const std::vector<NotSent>& try_publish(const std::vector<Transform>& X_PC,
                                                        std::optional<Time> stamp = std::nullopt);

 private:
  std::shared_ptr<Sender<Update>> sender_;
};

/// As EdgeStream, for joint positions, as Client::publish_joints() does. If a joint of another
/// partition mimics one, that is listed if one of them was not sent it. Joints of this process's
/// own partition are applied under a lock shared with the receiving threads; if that is taken,
/// their share fails with kTimeout instead of waiting.
class TFDUDE_EXPORT JointStream {
 public:
  explicit JointStream(std::shared_ptr<Sender<JointUpdate>> sender);
  JointStream(JointStream&&) noexcept;
  JointStream& operator=(JointStream&&) noexcept;
  JointStream(const JointStream&) = delete;
  JointStream& operator=(const JointStream&) = delete;
  ~JointStream();

  /// As EdgeStream::try_publish().
  /// @param positions  one per joint, in the order in which the stream was opened [rad or m]
  /// @param variances  of the positions [rad² or m²]; none: unspecified
  [[nodiscard]] const std::vector<NotSent>& try_publish(const std::vector<double>& positions,
                                                        const std::vector<double>& variances,
                                                        std::optional<Time> stamp = std::nullopt);

 private:
  std::shared_ptr<Sender<JointUpdate>> sender_;
};

}  // namespace tfdude
