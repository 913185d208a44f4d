#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <string>

#include "tfdude/partition/messages.hpp"

#include "transport/fastdds/compat.hpp"

namespace tfdude::fastdds {

/// The participant's part of a DDS identity: unique in the domain, new at every start.
[[nodiscard]] PeerId peer_of(const ertps::GuidPrefix_t& prefix);

/// The DDS partition in which a peer reads its replies.
[[nodiscard]] std::string reply_partition(const PeerId& peer);

/// The name a participant announces: whether it serves a partition, and which.
[[nodiscard]] std::string participant_name(const std::string& partition);

/// Who was met, and whose presence has come. Thread-safe.
class Peers {
 public:
  /// Whatever answers a newcomer has answered, as a rule, once nobody new was met for this long.
  static constexpr std::chrono::milliseconds kQuiet{200};

  void met(const ertps::GuidPrefix_t& prefix, const std::string& name);
  void left(const ertps::GuidPrefix_t& prefix);
  void present(const ertps::GuidPrefix_t& prefix);

  /// Whether some server was met, nobody new for a while, and all servers have said what they serve.
  [[nodiscard]] bool settled() const;

 private:
  using Clock = std::chrono::steady_clock;

  mutable std::mutex mutex_;
  std::map<PeerId, bool> servers_;  // whether its presence has come
  Clock::time_point last_met_{};
};

}  // namespace tfdude::fastdds
