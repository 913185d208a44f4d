#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

#include "transport/fastdds/compat.hpp"
#include "transport/fastdds/gate.hpp"

namespace tfdude::fastdds {

/// How a participant enters a domain so that it hears whatever answers it. Nobody answers twice: who is not
/// heard is met at its next announcement only, and what it told of its endpoints is asked for again after
/// 70 ms, a time of Fast DDS's built-in readers that cannot be set.
///
/// - Fast DDS 2.9 announces a participant before it starts to receive (RTPSParticipantImpl::enable). So
///   nothing is sent until the participant is there, and the first announcement is the next of the initial
///   ones, some milliseconds later.
/// - An answer comes to the multicast socket and what follows on it to the unicast one, where another thread
///   may be faster. So a client does not listen to multicast: all comes to one socket, in order. It
///   then meets later participants by its own announcements, and other clients not at all.
/// - A client announces itself every 2 ms at first, later every 100 ms; servers as the profile says.
class DiscoveryGate {
 public:
  /// @param gate  what is received over UDP passes it
  explicit DiscoveryGate(std::shared_ptr<Gate> gate) : gate_(std::move(gate)) {}

  /// Prepares a participant that is going to be created. Of transports other than UDP, and of discovery that
  /// the profile has arranged otherwise, all stays as it is.
  void prepare(edds::DomainParticipantQos& qos, std::uint32_t domain, bool client) const;

  /// The participant is there.
  void open() { open_->store(true, std::memory_order_relaxed); }

 private:
  const std::shared_ptr<Gate> gate_;
  const std::shared_ptr<std::atomic<bool>> open_ = std::make_shared<std::atomic<bool>>(false);
};

}  // namespace tfdude::fastdds
