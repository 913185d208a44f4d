#include "guarded_udp.hpp"

#include <cstdint>
#include <utility>

#include "transport/fastdds/datagram_guard.hpp"
#include "transport/fastdds/farewells.hpp"
#include "transport/fastdds/send_filter.hpp"

namespace tfdude::ros {
namespace {

using fastdds::DatagramGuard;
using fastdds::Farewells;
namespace ertps = fastdds::ertps;
namespace etransport = fastdds::etransport;

// With the ports of ROS, messages of discovery come to even ones (RTPS 2.2, section 9.6.1).
bool is_of_discovery(const ertps::Locator_t& local) { return local.port % 2 == 0; }

struct GuardedDescriptor final : etransport::ChainingTransportDescriptor {
  using ChainingTransportDescriptor::ChainingTransportDescriptor;
  [[nodiscard]] etransport::TransportInterface* create_transport() const override;

  std::shared_ptr<DatagramGuard> guard = std::make_shared<DatagramGuard>(false);
  std::shared_ptr<Farewells> farewells = std::make_shared<Farewells>();
};

class GuardedTransport final : public fastdds::SendFilter {
 public:
  explicit GuardedTransport(const GuardedDescriptor& descriptor)
      : SendFilter(descriptor), descriptor_(descriptor) {}

  etransport::TransportDescriptorInterface* get_configuration() override { return &descriptor_; }

  void receive(etransport::TransportReceiverInterface* next, const ertps::octet* bytes,
               std::uint32_t size, const ertps::Locator_t& local,
               const ertps::Locator_t& remote) override {
    const auto now = DatagramGuard::Clock::now();
    const auto sender = [&remote] { return ertps::IPLocator::ip_to_string(remote); };
    const auto take = [&](const std::uint8_t* datagram, std::size_t many) {
      SendFilter::receive(next, datagram, static_cast<std::uint32_t>(many), local, remote);
    };
    const auto deliver = [&](const DatagramGuard::Bytes* all, std::size_t many) {
      if (is_of_discovery(local)) {
        descriptor_.farewells->take([&](const auto& said) { take(said.data(), said.size()); });
      }
      for (std::size_t i = 0; i < many; ++i) take(all[i].data, all[i].size);
    };
    descriptor_.guard->receive(bytes, size, now, sender, deliver);
    descriptor_.guard->take_departed(
        now, [this](const PeerId& peer) { descriptor_.farewells->say_for(peer); });
  }

 private:
  Datagram to_send(ertps::SenderResource*, const Datagram& datagram) override {
    descriptor_.guard->send(datagram.bytes, datagram.size);
    return datagram;
  }
  [[nodiscard]] bool may_send(const ertps::Locator_t&) override { return true; }
  void heard(const ertps::Locator_t&) const override {}

  GuardedDescriptor descriptor_;
};

etransport::TransportInterface* GuardedDescriptor::create_transport() const {
  return new GuardedTransport(*this);
}

}  // namespace

std::shared_ptr<etransport::TransportDescriptorInterface> guarded(
    std::shared_ptr<etransport::UDPv4TransportDescriptor> udp) {
  auto descriptor = std::make_shared<GuardedDescriptor>(std::move(udp));
  // Cyclone DDS repeats only the first one of a sample, and waits for NACK_FRAG.
  descriptor->guard->passes_fragments();
  // Fast DDS 3 passes what it sends in pieces.
  if (TFDUDE_FASTDDS_MAJOR == 2) descriptor->guard->sees_all_sent();
  return descriptor;
}

}  // namespace tfdude::ros
