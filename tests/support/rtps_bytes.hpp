#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

// Datagrams of RTPS, made by hand as RTPS 2.2, 9.4, says, little-endian.
namespace tfdude::testing {

using Prefix = std::array<std::uint8_t, 12>;
using Entity = std::array<std::uint8_t, 4>;

/// The built-in endpoints of discovery: publications announced, and the participant itself.
inline constexpr Entity kPublicationsWriter{0x00, 0x00, 0x03, 0xC2};
inline constexpr Entity kPublicationsReader{0x00, 0x00, 0x03, 0xC7};
inline constexpr Entity kParticipantWriter{0x00, 0x01, 0x00, 0xC2};
inline constexpr Entity kParticipantReader{0x00, 0x01, 0x00, 0xC7};
inline constexpr Entity kHandshakeWriter{0x00, 0x02, 0x01, 0xC3};
inline constexpr Entity kUserWriter{0x00, 0x00, 0x01, 0x03};
inline constexpr Entity kUserReader{0x00, 0x00, 0x01, 0x04};

class Datagram {
 public:
  using Bytes = std::vector<std::uint8_t>;

  explicit Datagram(const Prefix& sender) {
    bytes_ = {'R', 'T', 'P', 'S', 2, 3, 1, 0x0F};
    raw(sender);
  }

  Datagram& to(const Prefix& receiver) { return begin(0x0E, 0x01).raw(receiver).end(); }
  Datagram& source(const Prefix& sender) {
    return begin(0x0C, 0x01).u32(0).u32(0x0F010302).raw(sender).end();
  }
  Datagram& gap(const Entity& reader, const Entity& writer, std::uint64_t start,
                std::uint64_t base) {
    return begin(0x08, 0x01).raw(reader).raw(writer).sn(start).sn(base).u32(0).end();
  }
  Datagram& heartbeat(const Entity& reader, const Entity& writer, std::uint64_t first,
                      std::uint64_t last, std::uint32_t count) {
    return begin(0x07, 0x01).raw(reader).raw(writer).sn(first).sn(last).u32(count).end();
  }
  Datagram& acknack(const Entity& reader, const Entity& writer, std::uint64_t base) {
    return begin(0x06, 0x01).raw(reader).raw(writer).sn(base).u32(0).u32(1).end();
  }
  Datagram& data(const Entity& reader, const Entity& writer, std::uint64_t number,
                 const Bytes& payload) {
    return begin(0x15, 0x05).u16(0).u16(16).raw(reader).raw(writer).sn(number).raw(payload).end();
  }
  /// DATA without a payload that disposes of an endpoint of the sender, and unregisters it.
  Datagram& dispose(const Entity& reader, const Entity& writer, std::uint64_t number,
                    const Entity& endpoint) {
    const Bytes sender(bytes_.begin() + 8, bytes_.begin() + 20);
    begin(0x15, 0x03).u16(0).u16(16).raw(reader).raw(writer).sn(number);
    u16(0x70).u16(16).raw(sender).raw(endpoint).u16(0x71).u16(4).raw(Bytes{0, 0, 0, 3});
    return u16(1).u16(0).end();
  }
  Datagram& fragment(const Entity& reader, const Entity& writer, std::uint64_t number,
                     std::uint32_t first, std::uint16_t many, std::uint16_t bytes,
                     std::uint32_t sample, std::size_t payload) {
    begin(0x16, 0x01).u16(0).u16(28).raw(reader).raw(writer).sn(number);
    return u32(first).u16(many).u16(bytes).u32(sample).raw(Bytes(payload)).end();
  }

  /// Any submessage; with numbers until end().
  Datagram& begin(std::uint8_t id, std::uint8_t flags) {
    raw(Bytes{id, flags, 0, 0});
    begun_ = bytes_.size();
    return *this;
  }
  Datagram& end() {
    while (bytes_.size() % 4 != 0) bytes_.push_back(0);
    return length(static_cast<std::uint16_t>(bytes_.size() - begun_));
  }
  /// Of the last submessage.
  Datagram& length(std::uint16_t length) {
    bytes_[begun_ - 2] = static_cast<std::uint8_t>(length & 0xFFU);
    bytes_[begun_ - 1] = static_cast<std::uint8_t>(length >> 8U);
    return *this;
  }
  Datagram& u16(std::uint16_t value) { return number(value, 2); }
  Datagram& u32(std::uint32_t value) { return number(value, 4); }
  Datagram& sn(std::uint64_t value) {
    u32(static_cast<std::uint32_t>(value >> 32U));
    return u32(static_cast<std::uint32_t>(value & 0xFFFFFFFFU));
  }
  template <class Range>
  Datagram& raw(const Range& range) {
    bytes_.insert(bytes_.end(), range.begin(), range.end());
    return *this;
  }

  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  Datagram& number(std::uint64_t value, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) {
      bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * i) & 0xFFU));
    }
    return *this;
  }

  Bytes bytes_;
  std::size_t begun_ = 0;
};

}  // namespace tfdude::testing
