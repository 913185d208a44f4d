#include "transport/fastdds/discovery_gate.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <mutex>
#include <sys/resource.h>
#include <thread>
#include <utility>
#include <vector>

#include "base/log.hpp"
#include "transport/fastdds/addresses.hpp"
#include "transport/fastdds/outgoing.hpp"
#include "transport/fastdds/rtps_layout.hpp"
#include "transport/fastdds/send_filter.hpp"
#include "transport/fastdds/send_throttle.hpp"

namespace tfdude::fastdds {
namespace {

using Flag = std::shared_ptr<std::atomic<bool>>;

// Fast DDS 3 passes what it sends in pieces, which nobody reads here.
constexpr bool kSeesSent = TFDUDE_FASTDDS_MAJOR == 2;

// A domain has ports for so many participants of a host.
constexpr std::uint32_t kParticipantsOfHost = 120;

// The ports at which participants of a domain receive data, not messages of discovery.
struct DataPorts {
  std::uint32_t first = 0;  // 0: not known
  std::uint32_t step = 1;

  [[nodiscard]] bool contain(std::uint32_t port) const {
    return first > 0 && port >= first && (port - first) % step == 0;
  }
};

struct GatedDescriptor final : etransport::ChainingTransportDescriptor {
  GatedDescriptor(std::shared_ptr<etransport::TransportDescriptorInterface> guarded, Flag flag,
                  bool of_client, DataPorts ports_of_data, std::shared_ptr<std::mutex> one_by_one,
                  std::shared_ptr<Gate> inward, std::shared_ptr<LifeSigns> signs,
                  std::shared_ptr<Acknowledgements> acks,
                  std::shared_ptr<DatagramGuard> datagram_guard,
                  std::shared_ptr<FairShare> fair_share, std::shared_ptr<Farewells> of_others,
                  std::shared_ptr<EndpointSets> endpoint_sets,
                  std::shared_ptr<SampleWindows> sample_windows,
                  std::shared_ptr<DiscoveryGate::Channels> opened)
      : ChainingTransportDescriptor(std::move(guarded)),
        open(std::move(flag)),
        client(of_client),
        data_ports(ports_of_data),
        discovering(std::move(one_by_one)),
        gate(std::move(inward)),
        life_signs(std::move(signs)),
        acknowledgements(std::move(acks)),
        guard(std::move(datagram_guard)),
        shares(std::move(fair_share)),
        farewells(std::move(of_others)),
        endpoints(std::move(endpoint_sets)),
        windows(std::move(sample_windows)),
        channels(std::move(opened)) {}

  [[nodiscard]] etransport::TransportInterface* create_transport() const override;

  // After so many bytes, a reliable writer requests acknowledgements from all its readers, in
  // addition to the periodic heartbeats. Fast DDS (2.9 and 3.1) counts all bytes that the
  // participant has ever repeated, or sent to participants that came later. So a participant that
  // runs for some time would request them with each DDS sample that it repeats, also for discovery:
  // a new client caused 100 packets for each endpoint of each owner, beside 100 other clients.
  [[nodiscard]] std::uint32_t min_send_buffer_size() const override {
    return std::numeric_limits<std::int32_t>::max();
  }

  Flag open;
  bool client;
  DataPorts data_ports;
  std::shared_ptr<std::mutex> discovering;  // held while a message of discovery is handled, or null
  std::shared_ptr<Gate> gate;
  std::shared_ptr<LifeSigns> life_signs;
  std::shared_ptr<Acknowledgements> acknowledgements;
  std::shared_ptr<DatagramGuard> guard;
  std::shared_ptr<FairShare> shares;
  std::shared_ptr<Farewells> farewells;
  std::shared_ptr<EndpointSets> endpoints;  // null: not compared
  std::shared_ptr<SampleWindows> windows;
  std::shared_ptr<DiscoveryGate::Channels> channels;
  std::shared_ptr<SendThrottle> throttle = std::make_shared<SendThrottle>();
};

// The address if it is another computer, otherwise 0: multicast groups need no ARP, and this
// computer is always reachable.
std::uint32_t host_of(const ertps::Locator_t& locator) {
  const ertps::octet* address = ertps::IPLocator::getIPv4(locator);
  if (address[0] == 127 || address[0] >= 224) return 0;
  return static_cast<std::uint32_t>(address[0]) << 24U |
         static_cast<std::uint32_t>(address[1]) << 16U |
         static_cast<std::uint32_t>(address[2]) << 8U | address[3];
}

// How often the calling thread has had nothing to do. Takes a third of a microsecond.
long waits_of_thread() {
  rusage use{};
  (void)getrusage(RUSAGE_THREAD, &use);
  return use.ru_nvcsw;
}

FairShare::Sender sender_at(const ertps::Locator_t& locator) {
  std::uint32_t address = 0;
  std::memcpy(&address, ertps::IPLocator::getIPv4(locator), sizeof address);
  return static_cast<FairShare::Sender>(address) << 32U | locator.port;
}

class GatedTransport final : public SendFilter {
 public:
  explicit GatedTransport(const GatedDescriptor& descriptor)
      : SendFilter(descriptor), descriptor_(descriptor), pace_(descriptor.client) {}

  etransport::TransportDescriptorInterface* get_configuration() override { return &descriptor_; }

  // Fast DDS reads these addresses as text, with the locale of the program: where the point
  // separates thousands, it gets none.
  bool getDefaultMetatrafficMulticastLocators(ertps::LocatorList_t& locators,
                                              std::uint32_t port) const override {
    if (!SendFilter::getDefaultMetatrafficMulticastLocators(locators, port)) return false;
    name_group(locators);
    return true;
  }
  void AddDefaultOutputLocator(ertps::LocatorList_t& locators) override {
    SendFilter::AddDefaultOutputLocator(locators);
    name_group(locators);
  }
  ertps::LocatorList_t NormalizeLocator(const ertps::Locator_t& locator) override {
    if (!ertps::IPLocator::isAny(locator)) return SendFilter::NormalizeLocator(locator);
    return named(locator, [this](const ertps::Locator_t& own) { return is_locator_allowed(own); });
  }

  bool OpenInputChannel(const ertps::Locator_t& at, etransport::TransportReceiverInterface* to,
                        std::uint32_t most) override {
    if (!SendFilter::OpenInputChannel(at, to, most)) return false;
    DiscoveryGate::Channels& channels = *descriptor_.channels;
    if (!ertps::IPLocator::isMulticast(at)) {
      ++(descriptor_.data_ports.contain(at.port) ? channels.of_data : channels.of_discovery);
    }
    return true;
  }
  // Fast DDS returns true also if it could not read the addresses of this computer.
  bool OpenOutputChannel(etransport::SendResourceList& resources,
                         const ertps::Locator_t& to) override {
    if (!SendFilter::OpenOutputChannel(resources, to)) return false;
    if (!resources.empty()) ++descriptor_.channels->outward;
    return true;
  }

  void receive(etransport::TransportReceiverInterface* next, const ertps::octet* bytes,
               std::uint32_t size, const ertps::Locator_t& local,
               const ertps::Locator_t& remote) override {
    const auto now = LifeSigns::Clock::now();
    const auto sender = [&remote] { return ertps::IPLocator::ip_to_string(remote); };
    descriptor_.guard->receive(bytes, size, now, sender,
                               [&](const DatagramGuard::Bytes* all, std::size_t many) {
                                 admitted(next, all, many, local, remote, now);
                               });
    descriptor_.guard->take_departed(
        now, [this](const PeerId& peer) { descriptor_.farewells->say_for(peer); });
  }

 private:
  void admitted(etransport::TransportReceiverInterface* next, const DatagramGuard::Bytes* all,
                std::size_t many, const ertps::Locator_t& local, const ertps::Locator_t& remote,
                LifeSigns::Clock::time_point now) {
    // Before the gate: whoever holds both may shut it.
    std::unique_lock<std::mutex> one_by_one;
    if (descriptor_.discovering != nullptr && !descriptor_.data_ports.contain(local.port)) {
      one_by_one = std::unique_lock(*descriptor_.discovering);
    }
    const Gate::Pass pass(*descriptor_.gate, now);
    if (!pass) return;
    for (std::size_t i = 0; i < many; ++i) {
      descriptor_.life_signs->heard(all[i].data, all[i].size, now);
      descriptor_.acknowledgements->heard(all[i].data, all[i].size);
    }
    // The sender is not to blame if the gate was shut.
    const auto begin = FairShare::Clock::now();
    FairShare::begin(begin, waits_of_thread());
    handle(next, all, many, local, remote, begin);
    FairShare::end(FairShare::Clock::now(), waits_of_thread());
  }

  // Messages of discovery come to a thread of their own.
  void handle(etransport::TransportReceiverInterface* next, const DatagramGuard::Bytes* all,
              std::size_t many, const ertps::Locator_t& local, const ertps::Locator_t& remote,
              FairShare::Clock::time_point now) {
    const auto take = [&](const std::uint8_t* bytes, std::size_t size) {
      SendFilter::receive(next, bytes, static_cast<std::uint32_t>(size), local, remote);
    };
    if (!descriptor_.data_ports.contain(local.port)) {
      for (std::size_t i = 0; i < many; ++i) compare_endpoints(all[i], now);
      // First, so that the announcement of one that did not leave discovers it anew.
      say_farewells(take, now);
      for (std::size_t i = 0; i < many; ++i) {
        if (!is_announcement(all[i].data, all[i].size)) descriptor_.farewells->busy(now);
        take(all[i].data, all[i].size);
      }
      return;
    }
    const FairShare::Sender sender = sender_at(remote);
    if (!descriptor_.shares->admits(sender, now)) return;
    for (std::size_t i = 0; i < many; ++i) {
      if (descriptor_.windows->admits(all[i].data, all[i].size)) take(all[i].data, all[i].size);
    }
    const auto end = FairShare::Clock::now();
    descriptor_.shares->spent(sender, end - now, end);
  }

  template <class Take>
  void say_farewells(const Take& take, Farewells::Clock::time_point now) {
    const auto when = descriptor_.farewells->when(now);
    if (when == Farewells::When::kLater) return;
    const auto say = [&](const Farewells::Datagram& farewell) {
      take(farewell.data(), farewell.size());
    };
    // Without keys, two threads that handle messages of discovery would wait for each other.
    if (when == Farewells::When::kNow || descriptor_.discovering == nullptr) {
      return descriptor_.farewells->take(say);
    }
    const Gate::Pause pause(*descriptor_.gate);
    std::this_thread::sleep_for(Farewells::kQuiet);
    descriptor_.farewells->take(say);
  }

  void compare_endpoints(const DatagramGuard::Bytes& datagram, FairShare::Clock::time_point now) {
    if (descriptor_.endpoints == nullptr ||
        !descriptor_.endpoints->contradicts(datagram.data, datagram.size, now)) {
      return;
    }
    PeerId sender{};
    std::copy_n(datagram.data + rtps::kPrefixAt, sender.size(), sender.begin());
    descriptor_.farewells->say_for(sender);
    log().warn(
        "a participant has other endpoints than were announced in its name; it is discovered anew");
  }

  Datagram to_send(ertps::SenderResource* through, const Datagram& datagram) override {
    announces_through_ = is_announcement(datagram.bytes, datagram.size) ? through : nullptr;
    descriptor_.guard->send(datagram.bytes, datagram.size);
    descriptor_.windows->sent(datagram.bytes, datagram.size);
    const Datagram needed{datagram.bytes, size_without_statistics(datagram.bytes, datagram.size)};
    if (announces_through_ == nullptr || descriptor_.endpoints == nullptr) return needed;
    announcement_ = descriptor_.endpoints->with_own(needed.bytes, needed.size);
    return {announcement_.data(), static_cast<std::uint32_t>(announcement_.size())};
  }

  [[nodiscard]] bool may_send(const ertps::Locator_t& to) override {
    if (!descriptor_.open->load(std::memory_order_relaxed)) return false;
    if (announces_through_ != nullptr &&
        !pace_.may_send(announces_through_, to, AnnouncementPace::Clock::now())) {
      return false;
    }
    const std::uint32_t host = host_of(to);
    return host == 0 || descriptor_.throttle->may_send(host, to.port, SendThrottle::Clock::now());
  }

  void heard(const ertps::Locator_t& from) const override {
    const std::uint32_t host = host_of(from);
    if (host != 0) descriptor_.throttle->heard(host, SendThrottle::Clock::now());
  }

  GatedDescriptor descriptor_;
  // Used by one thread at a time: Fast DDS sends with a lock of the participant held.
  AnnouncementPace pace_;
  ertps::SenderResource* announces_through_ = nullptr;  // null: what is sent is something else
  std::vector<std::uint8_t> announcement_;
};

etransport::TransportInterface* GatedDescriptor::create_transport() const {
  return new GatedTransport(*this);
}

// What Fast DDS adds to each announcement about the process, for its tools, and the endpoints for
// liveliness, which no topic of ours has.
void leave_out_unused(edds::DomainParticipantQos& qos) {
  auto& properties = qos.properties().properties();
  const auto is_physical = [](const auto& property) {
    return property.name().rfind("fastdds.physical_data.", 0) == 0;
  };
  properties.erase(std::remove_if(properties.begin(), properties.end(), is_physical),
                   properties.end());
  qos.wire_protocol().builtin.use_WriterLivelinessProtocol = false;
}

// As Fast DDS would by default, but for the multicast locator that this participant listens to.
void hear_by_unicast_only(edds::DomainParticipantQos& qos, std::uint32_t domain) {
  auto& builtin = qos.wire_protocol().builtin;
  const bool arranged = builtin.discovery_config.discoveryProtocol != DiscoveryProtocol::SIMPLE ||
                        !builtin.metatrafficUnicastLocatorList.empty() ||
                        !builtin.metatrafficMulticastLocatorList.empty() ||
                        !builtin.initialPeersList.empty();
  if (arranged) return;
  ertps::Locator_t everywhere;
  ertps::IPLocator::setIPv4(everywhere, 0, 0, 0, 0);
  builtin.metatrafficUnicastLocatorList.push_back(everywhere);
  ertps::Locator_t group;
  name_group(group);
  group.port = qos.wire_protocol().port.getMulticastPort(domain);
  builtin.initialPeersList.push_back(group);
}

// A client's first announcements follow each other soon, so that it need not wait long for the next
// one. There are few new clients at a time, while servers often start all at once.
void announce_eagerly(edds::DomainParticipantQos& qos) {
  auto& discovery = qos.wire_protocol().builtin.discovery_config;
  discovery.initial_announcements.period = {0, 2'000'000};
}

bool is_udp(const std::shared_ptr<etransport::TransportDescriptorInterface>& transport) {
  return std::dynamic_pointer_cast<etransport::UDPv4TransportDescriptor>(transport) != nullptr;
}

bool only_udp(const edds::DomainParticipantQos& qos) {
  const auto& transports = qos.transport().user_transports;
  return !qos.transport().use_builtin_transports &&
         std::all_of(transports.begin(), transports.end(), is_udp);
}

// One for discovery and one for data, which depend on the domain.
bool uses_standard_ports(const edds::DomainParticipantQos& qos) {
  return qos.wire_protocol().builtin.metatrafficUnicastLocatorList.empty() &&
         qos.wire_protocol().default_unicast_locator_list.empty();
}

bool has_keys(const edds::DomainParticipantQos& qos) {
  const auto& properties = qos.properties().properties();
  return std::any_of(properties.begin(), properties.end(),
                     [](const auto& property) { return property.name() == "dds.sec.auth.plugin"; });
}

}  // namespace

bool DiscoveryGate::hears_announcements(const edds::DomainParticipantQos& qos) {
  const auto& discovery = qos.wire_protocol().builtin.discovery_config;
  return discovery.discoveryProtocol == DiscoveryProtocol::SIMPLE && only_udp(qos);
}

void DiscoveryGate::prepare(edds::DomainParticipantQos& qos, std::uint32_t domain, bool client) {
  auto& builtin = qos.wire_protocol().builtin;
  builtin.mutation_tries = std::max(builtin.mutation_tries, kParticipantsOfHost - 1);
  DataPorts data_ports;
  if (only_udp(qos) && uses_standard_ports(qos)) {
    const auto& port = qos.wire_protocol().port;
    data_ports.first = port.portBase + port.domainIDGain * domain + port.offsetd3;
    data_ports.step = port.participantIDGain;
    // Lists of multicast addresses alone leave out ports for messages to the participant alone.
    counts_channels_ = !qos.transport().user_transports.empty() &&
                       qos.wire_protocol().builtin.metatrafficMulticastLocatorList.empty() &&
                       qos.wire_protocol().default_multicast_locator_list.empty() &&
                       port.offsetd1 < port.offsetd3;
  }
  if (kSeesSent && only_udp(qos)) guard_->sees_all_sent();
  auto discovering = has_keys(qos) ? std::make_shared<std::mutex>() : nullptr;
  leave_out_unused(qos);
  if (client) announce_eagerly(qos);
  if (client && only_udp(qos)) hear_by_unicast_only(qos, domain);
  for (auto& transport : qos.transport().user_transports) {
    if (!is_udp(transport)) continue;
    transport = std::make_shared<GatedDescriptor>(
        transport, open_, client, data_ports, discovering, gate_, life_signs_, acknowledgements_,
        guard_, shares_, farewells_, discovering == nullptr ? endpoints_ : nullptr, windows_,
        channels_);
  }
}

Result<void> DiscoveryGate::check() const {
  const Channels& open = *channels_;
  if (!counts_channels_ || (open.of_discovery > 0 && open.of_data > 0 && open.outward > 0)) {
    return {};
  }
  return fail(
      Errc::kTransport,
      "a socket could not be opened: no interface of the profile is up, or the ports of the "
      "domain or the descriptors of this process are used up");
}

}  // namespace tfdude::fastdds
