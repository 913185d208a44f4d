#pragma once

#include <chrono>
#include <cstdint>
#include <set>
#include <vector>

#include "transport/fastdds/compat.hpp"

namespace tfdude::fastdds {

/// A transport that sends through another one, only to allowed destinations, and sees the source of
/// each datagram.
class SendFilter : public etransport::ChainingTransport {
 public:
  using ChainingTransport::ChainingTransport;

  bool OpenOutputChannel(etransport::SendResourceList& resources,
                         const ertps::Locator_t& to) override {
    if (!ChainingTransport::OpenOutputChannel(resources, to)) return false;
    opened_.insert(to);
    return true;
  }

#if TFDUDE_FASTDDS_MAJOR == 2
  bool send(ertps::SenderResource* through, const ertps::octet* bytes, std::uint32_t size,
            ertps::LocatorsIterator* begin, ertps::LocatorsIterator* end,
            const std::chrono::steady_clock::time_point& deadline) override {
    const Datagram sent = to_send(through, {bytes, size});
    return send_to(begin, end, [&](ertps::LocatorsIterator* from, ertps::LocatorsIterator* to) {
      return through->send(sent.bytes, sent.size, from, to, deadline);
    });
  }
#else
  bool send(ertps::SenderResource* through, const std::vector<ertps::NetworkBuffer>& buffers,
            std::uint32_t size, ertps::LocatorsIterator* begin, ertps::LocatorsIterator* end,
            const std::chrono::steady_clock::time_point& deadline) override {
    return send_to(begin, end, [&](ertps::LocatorsIterator* from, ertps::LocatorsIterator* to) {
      return through->send(buffers, size, from, to, deadline);
    });
  }
#endif

  void receive(etransport::TransportReceiverInterface* next, const ertps::octet* bytes,
               std::uint32_t size, const ertps::Locator_t& local,
               const ertps::Locator_t& remote) override {
    heard(remote);
    next->OnDataReceived(bytes, size, local, remote);
  }

 protected:
  struct Datagram {
    const ertps::octet* bytes;
    std::uint32_t size;
  };

 private:
  /// What to send instead. Not called by Fast DDS 3, which passes datagrams in pieces.
  virtual Datagram to_send(ertps::SenderResource*, const Datagram& datagram) { return datagram; }
  [[nodiscard]] virtual bool may_send(const ertps::Locator_t& to) = 0;
  virtual void heard(const ertps::Locator_t& from) const = 0;

  // A datagram that may not be sent counts as sent, like one that is lost on the way.
  template <class Send>
  bool send_to(ertps::LocatorsIterator* begin, ertps::LocatorsIterator* end, Send send) {
    thread_local std::vector<ertps::Locator_t> destinations;  // kept for its memory
    destinations.clear();
    for (auto& at = *begin; at != *end; ++at) {
      if (may_send(*at) && is_open(*at)) destinations.push_back(*at);
    }
    if (destinations.empty()) return true;
    etransport::Locators from(destinations.cbegin());
    etransport::Locators to(destinations.cend());
    return send(&from, &to);
  }

  // Fast DDS (2.9 and 3.1) opens the destinations of its announcements when it discovers a
  // participant: the multicast address only, if several participants have it. When all but one have
  // left, it sends to the unicast address of the last one. If nothing else has opened that, as with
  // a participant that is not authenticated, an assertion in its statistics ends the process. The
  // sockets exist already.
  bool is_open(const ertps::Locator_t& to) {
    if (opened_.count(to) != 0) return true;
    etransport::SendResourceList none;
    return OpenOutputChannel(none, to);
  }

  // Fast DDS opens and sends with a lock of the participant held.
  std::set<ertps::Locator_t> opened_;
};

}  // namespace tfdude::fastdds
