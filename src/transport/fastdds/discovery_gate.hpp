#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

#include "tfdude/base/result.hpp"

#include "transport/fastdds/acknowledgements.hpp"
#include "transport/fastdds/compat.hpp"
#include "transport/fastdds/datagram_guard.hpp"
#include "transport/fastdds/endpoint_sets.hpp"
#include "transport/fastdds/fair_share.hpp"
#include "transport/fastdds/farewells.hpp"
#include "transport/fastdds/gate.hpp"
#include "transport/fastdds/life_signs.hpp"
#include "transport/fastdds/sample_windows.hpp"

namespace tfdude::fastdds {

/// Makes a new participant of a domain receive all answers to its announcement. Nobody answers
/// twice: a participant whose answer is missed is discovered only at its next announcement. Its
/// endpoints are asked for again after 70 ms, a time of Fast DDS's built-in readers that cannot be
/// set.
///
/// - Fast DDS 2.9 announces a participant before it starts to receive
///   (RTPSParticipantImpl::enable). So nothing is sent until the participant is created. The first
///   announcement sent is the next of the initial ones, some milliseconds later.
/// - An answer comes to the multicast socket, and the messages after it to the unicast one, where
///   another thread may be faster. So a client does not listen to multicast: all messages come to
///   one socket, in order. It then discovers later participants by its own announcements, and does
///   not discover other clients.
/// - A client announces itself every 2 ms at first, at longer and longer intervals
///   (AnnouncementPace); later, and a server always, as set in the profile.
/// - Fast DDS searches free ports for 101 participants of a host. The next ones receive nothing,
///   and nobody is told, as without descriptors for its sockets. So it searches through all ports
///   of the domain here, for 120 participants, from its number in this process on, which Fast DDS
///   2.9 counts up; and check() tells whether it has got some.
/// - With keys, messages of discovery are handled one after the other. A participant is announced
///   at one socket, and its handshake comes to another one. Fast DDS (2.9 and 3.1) drops a message
///   of the handshake while another thread handles something of the same participant, and repeats
///   it later: 2.9 after a second. Of first meetings with one daemon, 6 % took so long.
class DiscoveryGate {
 public:
  /// @param gate  all datagrams received over UDP pass it
  /// @param life_signs, acknowledgements  are told of each of them
  /// @param guard  decides which of them Fast DDS has
  /// @param shares  and whether those with data would take too much of its time
  /// @param farewells  are given to Fast DDS as if they had been received
  /// @param windows  decide which samples Fast DDS keeps until earlier ones come
  /// @param endpoints  announced with this participant, and compared with what others announce
  DiscoveryGate(
      std::shared_ptr<Gate> gate, std::shared_ptr<LifeSigns> life_signs,
      std::shared_ptr<Acknowledgements> acknowledgements = std::make_shared<Acknowledgements>(),
      std::shared_ptr<DatagramGuard> guard = std::make_shared<DatagramGuard>(false),
      std::shared_ptr<FairShare> shares = std::make_shared<FairShare>(),
      std::shared_ptr<Farewells> farewells = std::make_shared<Farewells>(),
      std::shared_ptr<EndpointSets> endpoints = std::make_shared<EndpointSets>(),
      std::shared_ptr<SampleWindows> windows = std::make_shared<SampleWindows>())
      : gate_(std::move(gate)),
        life_signs_(std::move(life_signs)),
        acknowledgements_(std::move(acknowledgements)),
        guard_(std::move(guard)),
        shares_(std::move(shares)),
        farewells_(std::move(farewells)),
        endpoints_(std::move(endpoints)),
        windows_(std::move(windows)) {}

  /// Prepares the creation of a participant. Changes neither transports other than UDP, nor
  /// discovery settings that the profile overrides.
  void prepare(edds::DomainParticipantQos& qos, std::uint32_t domain, bool client);

  /// Whether participants with these settings hear each other's periodic announcements, and
  /// LifeSigns sees them: discovery is the simple one, and all transports are UDP.
  [[nodiscard]] static bool hears_announcements(const edds::DomainParticipantQos& qos);

  /// Whether the participant, which has been created, can send, and receives what is sent to it
  /// alone: messages of discovery, and data. Not known if the profile overrides the ports.
  /// @return kTransport
  [[nodiscard]] Result<void> check() const;

  /// Lets the participant send: it has been created.
  void open() { open_->store(true, std::memory_order_relaxed); }

  /// Drops what the participant sends. When it leaves, it says so at the end, and nobody need be
  /// told of each endpoint before.
  void close() { open_->store(false, std::memory_order_relaxed); }

  /// What is open: ports for messages to the participant alone, and sockets to send through.
  struct Channels {
    std::atomic<int> of_discovery{0};
    std::atomic<int> of_data{0};
    std::atomic<int> outward{0};
  };

 private:
  const std::shared_ptr<Gate> gate_;
  const std::shared_ptr<LifeSigns> life_signs_;
  const std::shared_ptr<Acknowledgements> acknowledgements_;
  const std::shared_ptr<DatagramGuard> guard_;
  const std::shared_ptr<FairShare> shares_;
  const std::shared_ptr<Farewells> farewells_;
  const std::shared_ptr<EndpointSets> endpoints_;
  const std::shared_ptr<SampleWindows> windows_;
  const std::shared_ptr<Channels> channels_ = std::make_shared<Channels>();
  bool counts_channels_ = false;
  const std::shared_ptr<std::atomic<bool>> open_ = std::make_shared<std::atomic<bool>>(false);
};

}  // namespace tfdude::fastdds
