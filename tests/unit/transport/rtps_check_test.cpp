#include "transport/fastdds/rtps_check.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/rtps_bytes.hpp"
#include "transport/fastdds/farewells.hpp"

namespace tfdude::fastdds {
namespace {

using testing::Datagram;
using testing::kHandshakeWriter;
using testing::kParticipantReader;
using testing::kParticipantWriter;
using testing::kPublicationsReader;
using testing::kPublicationsWriter;
using testing::kUserReader;
using testing::kUserWriter;
using Flaw = DatagramFlaw;
using Bytes = Datagram::Bytes;

constexpr testing::Prefix kSender{1, 15, 2, 3};
constexpr testing::Prefix kReceiver{1, 15, 9, 9};

class Claims final : public NumberClaims {
 public:
  bool admit(const NumberClaim& claim) override {
    all.push_back(claim);
    return true;
  }
  bool admit_participant(const NumberClaim::Prefix& participant) override {
    participants.push_back(participant);
    return participants.size() < 3;
  }
  std::vector<NumberClaim> all;
  std::vector<NumberClaim::Prefix> participants;
};

Flaw flaw_of(const Bytes& bytes, bool secured = false) {
  Claims claims;
  return check_datagram(bytes.data(), bytes.size(), secured, claims);
}
Flaw flaw_of(const Datagram& datagram, bool secured = false) {
  return flaw_of(datagram.bytes(), secured);
}

Datagram from_sender() { return Datagram(kSender).to(kReceiver); }

// Encapsulation, parameters, and the end of the list.
Bytes announcement(std::uint16_t id, const Bytes& value) {
  Datagram list(kSender);
  list.u16(0x0300).u16(0).u16(id).u16(static_cast<std::uint16_t>(value.size())).raw(value);
  list.u16(1).u16(0);
  return {list.bytes().begin() + 20, list.bytes().end()};
}

Bytes numbers(const std::vector<std::uint32_t>& values) {
  Datagram bytes(kSender);
  for (const std::uint32_t value : values) bytes.u32(value);
  return {bytes.bytes().begin() + 20, bytes.bytes().end()};
}

Bytes handshake(const std::vector<std::uint32_t>& after_identities) {
  std::vector<std::uint32_t> all(1 + 24, 0);
  all[0] = 0x0100;  // little-endian
  all.insert(all.end(), after_identities.begin(), after_identities.end());
  return numbers(all);
}

}  // namespace

TEST_CASE("datagrams: what a DDS sends passes") {
  CHECK(flaw_of(from_sender().gap(kPublicationsReader, kPublicationsWriter, 3, 9)) == Flaw::kNone);
  CHECK(flaw_of(from_sender().heartbeat(kUserReader, kUserWriter, 1, 0, 1)) == Flaw::kNone);
  CHECK(flaw_of(from_sender().heartbeat(kUserReader, kUserWriter, 7, 70, 9)) == Flaw::kNone);
  CHECK(flaw_of(from_sender().acknack(kUserReader, kUserWriter, 0)) == Flaw::kNone);
  CHECK(flaw_of(from_sender().data(kUserReader, kUserWriter, 5, Bytes(40))) == Flaw::kNone);
  CHECK(flaw_of(from_sender().fragment(kUserReader, kUserWriter, 5, 2, 1, 1000, 1500, 500)) ==
        Flaw::kNone);
  CHECK(flaw_of(Datagram(kSender).begin(0x09, 0x03).end()) == Flaw::kNone);  // no time
  CHECK(flaw_of(Datagram(kSender)) == Flaw::kNone);
}

// The seeds of the fuzzer: whether with keys, and then datagrams, each with its length before it.
TEST_CASE("datagrams: what Fast DDS and Cyclone DDS have sent passes") {
  std::size_t datagrams = 0;
  for (const auto& file : std::filesystem::directory_iterator(TFDUDE_DATAGRAMS)) {
    std::ifstream stream(file.path(), std::ios::binary);
    const Bytes bytes{std::istreambuf_iterator<char>(stream), {}};
    REQUIRE(bytes.size() > 3);
    const std::size_t length = bytes[1] | bytes[2] << 8U;
    REQUIRE(bytes.size() == 3 + length);
    CAPTURE(file.path().string());
    const Flaw flaw = flaw_of(Bytes(bytes.begin() + 3, bytes.end()), bytes[0] == 1);
    // With keys, who says that it leaves is believed later.
    CHECK((flaw == Flaw::kNone || (bytes[0] == 1 && flaw == Flaw::kFarewell)));
    ++datagrams;
  }
  CHECK(datagrams > 100);
}

TEST_CASE("datagrams: the last submessage may have no length") {
  CHECK(flaw_of(from_sender().gap(kUserReader, kUserWriter, 3, 9).length(0)) == Flaw::kNone);
  CHECK(flaw_of(from_sender().gap(kUserReader, kUserWriter, 3, 1U << 31U).length(0)) ==
        Flaw::kNumber);
}

// Fast DDS 2.9 walks through all of these numbers (CVE-2025-64438).
TEST_CASE("datagrams: ranges are short") {
  const auto gap = [](std::uint64_t start, std::uint64_t base) {
    return flaw_of(from_sender().gap(kPublicationsReader, kPublicationsWriter, start, base));
  };
  CHECK(gap(1, 1 + kLongestRange) == Flaw::kNone);
  CHECK(gap(1, 2 + kLongestRange) == Flaw::kNumber);
  CHECK(gap(1, std::uint64_t{0x7FFFFFFF} << 32U) == Flaw::kNumber);
  CHECK(gap(9, 8) == Flaw::kNumber);
  CHECK(gap(0, 1) == Flaw::kNumber);
  CHECK(gap(~0ULL, ~0ULL) == Flaw::kNumber);
  const auto heartbeat = [](std::uint64_t first, std::uint64_t last) {
    return flaw_of(from_sender().heartbeat(kUserReader, kUserWriter, first, last, 1));
  };
  CHECK(heartbeat(1, kLongestRange) == Flaw::kNone);
  CHECK(heartbeat(1, kLongestRange + 1) == Flaw::kNumber);
  CHECK(heartbeat(3, 1) == Flaw::kNumber);
  CHECK(heartbeat(0, 1) == Flaw::kNumber);
  CHECK(heartbeat(1ULL << 63U, 1ULL << 63U) == Flaw::kNumber);
}

TEST_CASE("datagrams: a set has at most 256 numbers, and all of them are there") {
  const auto acknack = [](std::uint32_t bits, std::size_t words) {
    Datagram datagram = from_sender();
    datagram.begin(0x06, 1).raw(kUserReader).raw(kUserWriter).sn(3).u32(bits);
    for (std::size_t i = 0; i < words; ++i) datagram.u32(0);
    return flaw_of(datagram.u32(1).end());
  };
  CHECK(acknack(256, 8) == Flaw::kNone);
  CHECK(acknack(257, 9) == Flaw::kNumber);
  CHECK(acknack(256, 6) == Flaw::kLength);
}

TEST_CASE("datagrams: headers and lengths fit") {
  Bytes other = from_sender().bytes();
  other[4] = 3;
  CHECK(flaw_of(other) == Flaw::kHeader);
  other = from_sender().bytes();
  other[0] = 'X';
  CHECK(flaw_of(other) == Flaw::kHeader);
  CHECK(flaw_of(Bytes(19)) == Flaw::kHeader);
  CHECK(flaw_of(Bytes()) == Flaw::kHeader);
  CHECK(flaw_of(from_sender().begin(0x07, 1).u32(0).end()) == Flaw::kLength);
  CHECK(flaw_of(from_sender().gap(kUserReader, kUserWriter, 1, 2).length(400)) == Flaw::kLength);
  CHECK(flaw_of(from_sender().raw(Bytes{7, 1, 0})) == Flaw::kLength);
  // Fewer bytes than DATA says are before the payload.
  Datagram data = from_sender();
  data.begin(0x15, 5).u16(0).u16(300).raw(kUserReader).raw(kUserWriter).sn(1).u32(0);
  CHECK(flaw_of(data.end()) == Flaw::kLength);
}

// Fast DDS 2.9 and 3.1 copy as many bytes of the last fragment as are missing from the sample.
TEST_CASE("datagrams: fragments have the bytes that they should have") {
  const auto fragment = [](std::uint32_t first, std::uint16_t many, std::uint16_t bytes,
                           std::uint32_t sample, std::size_t payload) {
    return flaw_of(
        from_sender().fragment(kUserReader, kUserWriter, 1, first, many, bytes, sample, payload));
  };
  CHECK(fragment(1, 2, 1000, 2000, 2000) == Flaw::kNone);
  CHECK(fragment(1, 2, 1000, 2000, 100) == Flaw::kLength);
  CHECK(fragment(1, 16'000, 1000, 16'000'000, 100) == Flaw::kLength);
  CHECK(fragment(0, 1, 1000, 2000, 1000) == Flaw::kNumber);
  CHECK(fragment(1, 0, 1000, 2000, 1000) == Flaw::kNumber);
  CHECK(fragment(3, 1, 1000, 2000, 1000) == Flaw::kNumber);
  CHECK(fragment(2, 2, 1000, 2000, 2000) == Flaw::kNumber);
  CHECK(fragment(1, 1, 3, 2000, 4) == Flaw::kNumber);
  CHECK(fragment(1, 1, 1000, kLargestSample + 1, 1000) == Flaw::kNumber);
  CHECK(fragment(0xFFFFFFFF, 0xFFFF, 0xFFFF, 0xFFFFFFFF, 1000) == Flaw::kNumber);
}

// CVE-2025-62599, -62600, -62602: memory is allocated before the length is compared with anything.
TEST_CASE("datagrams: tokens of an announcement have what their counts say") {
  const auto announced = [](std::uint16_t id, const Bytes& value) {
    return flaw_of(
        Datagram(kSender).data(kParticipantReader, kParticipantWriter, 1, announcement(id, value)),
        true);
  };
  const Bytes fine = numbers({4, 0x41414141, 1, 4, 0x41414141, 4, 0x42424242, 0});
  CHECK(announced(0x1001, fine) == Flaw::kNone);
  CHECK(announced(0x1001, numbers({4, 0x41414141, 0x7FFFFFFF, 0})) == Flaw::kLength);
  CHECK(announced(0x1002, numbers({4, 0x41414141, 0, 0x7FFFFFFF})) == Flaw::kLength);
  CHECK(announced(0x1002, numbers({4, 0x41414141, 0, 1, 4, 0, 0xFFFFFFF0})) == Flaw::kLength);
  CHECK(announced(0x1002, numbers({0xFFFFFFFF, 0, 0})) == Flaw::kLength);
  CHECK(announced(0x0050, numbers({0x7FFFFFFF})) == Flaw::kNone);  // not a token
  // A parameter beyond the end.
  Bytes list = announcement(0x1001, fine);
  list[6] = 0xFF;
  CHECK(flaw_of(Datagram(kSender).data(kParticipantReader, kParticipantWriter, 1, list)) ==
        Flaw::kLength);
}

// CVE-2025-62603.
TEST_CASE("datagrams: a handshake has what its counts say") {
  const auto shaken = [](const Bytes& payload) {
    return flaw_of(from_sender().data({0, 2, 1, 0xC4}, kHandshakeWriter, 1, payload), true);
  };
  CHECK(shaken(handshake({4, 0x41414141, 1, 4, 0x41414141, 0, 0})) == Flaw::kNone);
  CHECK(shaken(handshake({4, 0x41414141, 0})) == Flaw::kNone);
  CHECK(shaken(handshake({4, 0x41414141, 0x10000000, 4, 0x41414141, 0, 0})) == Flaw::kLength);
  CHECK(shaken(handshake({4, 0x41414141, 1, 4, 0x41414141, 0x10000000, 0})) == Flaw::kLength);
  CHECK(shaken(numbers({0x0100, 0, 0})) == Flaw::kLength);
}

// DDS Security 1.1, 8.4.2.4: the other messages are protected as a whole.
TEST_CASE("datagrams: with keys, only announcements and handshakes come unprotected") {
  const Bytes list = announcement(0x0050, numbers({0}));
  CHECK(flaw_of(Datagram(kSender).data(kParticipantReader, kParticipantWriter, 1, list), true) ==
        Flaw::kNone);
  for (const auto& datagram :
       {from_sender().gap(kPublicationsReader, kPublicationsWriter, 1, 2),
        from_sender().heartbeat(kPublicationsReader, kPublicationsWriter, 1, 2, 1),
        from_sender().acknack(kPublicationsReader, kPublicationsWriter, 1),
        from_sender().data(kUserReader, kUserWriter, 1, Bytes(8)),
        from_sender().fragment(kUserReader, kUserWriter, 1, 1, 1, 100, 200, 100),
        from_sender().heartbeat(kParticipantReader, kParticipantWriter, 1, 1, 1),
        from_sender()
            .begin(0x12, 1)
            .raw(kUserReader)
            .raw(kUserWriter)
            .sn(1)
            .u32(1)
            .u32(0)
            .u32(0)
            .end(),
        from_sender().begin(0x13, 1).raw(kUserReader).raw(kUserWriter).sn(1).sn(1).end()}) {
    CHECK(flaw_of(datagram) == Flaw::kNone);
    CHECK(flaw_of(datagram, true) == Flaw::kUnprotected);
  }
}

TEST_CASE("datagrams: what is protected passes, and its plain parts are checked") {
  const Bytes header(20);
  Datagram encrypted(kSender);
  encrypted.begin(0x33, 1).raw(header).end();
  encrypted.begin(0x30, 1).raw(Bytes{0, 0, 0, 8}).raw(Bytes(8)).end();
  encrypted.begin(0x34, 1).raw(header).end();
  CHECK(flaw_of(encrypted, true) == Flaw::kNone);
  const auto signed_gap = [&](std::uint64_t base) {
    Datagram datagram(kSender);
    datagram.begin(0x33, 1).raw(header).end().source(kSender);
    datagram.gap(kUserReader, kUserWriter, 1, base).begin(0x34, 1).raw(header).end();
    return flaw_of(datagram, true);
  };
  CHECK(signed_gap(5) == Flaw::kNone);
  CHECK(signed_gap(1ULL << 40U) == Flaw::kNumber);
  // Keys are exchanged in protected submessages.
  Datagram exchange = from_sender();
  exchange.begin(0x31, 1).raw(header).end();
  exchange.begin(0x30, 1).raw(Bytes{0, 0, 0, 8}).raw(Bytes(8)).end();
  exchange.begin(0x32, 1).raw(header).end();
  CHECK(flaw_of(exchange, true) == Flaw::kNone);
  CHECK(flaw_of(exchange.gap(kUserReader, kUserWriter, 1, 2), true) == Flaw::kUnprotected);
  Datagram body(kSender);
  body.begin(0x33, 1).raw(header).end().begin(0x30, 1).raw(Bytes{0, 0, 9, 0}).end();
  CHECK(flaw_of(body, true) == Flaw::kLength);
  CHECK(flaw_of(Datagram(kSender).begin(0x33, 1).u32(0).end(), true) == Flaw::kLength);
}

TEST_CASE("datagrams: numbers are those of the sender that the datagram names") {
  constexpr testing::Prefix kOther{7, 7, 7};
  Datagram datagram = from_sender().heartbeat(kUserReader, kUserWriter, 3, 8, 42);
  datagram.source(kOther).data(kUserReader, kPublicationsWriter, 5, Bytes(8));
  Claims claims;
  REQUIRE(check_datagram(datagram.bytes().data(), datagram.bytes().size(), false, claims) ==
          Flaw::kNone);
  REQUIRE(claims.all.size() == 2);
  CHECK(claims.all[0].sender == kSender);
  CHECK(claims.all[0].writer == kUserWriter);
  CHECK(claims.all[0].first == 3);
  CHECK(claims.all[0].last == 8);
  CHECK(claims.all[0].count == 42);
  CHECK(claims.all[1].sender == kOther);
  CHECK(claims.all[1].writer == kPublicationsWriter);
  CHECK(claims.all[1].last == 5);
}

TEST_CASE("datagrams: heartbeats that are sent are claims") {
  const Datagram datagram = from_sender()
                                .data(kUserReader, kUserWriter, 8, Bytes(8))
                                .heartbeat(kUserReader, kUserWriter, 3, 8, 42);
  Claims claims;
  for_each_heartbeat(datagram.bytes().data(), datagram.bytes().size(), claims);
  REQUIRE(claims.all.size() == 1);
  CHECK(claims.all[0].writer == kUserWriter);
  CHECK(claims.all[0].last == 8);
}

TEST_CASE(
    "datagrams: with keys, what says that a participant leaves or is soon lost is not for Fast "
    "DDS") {
  const Bytes list = announcement(0x0050, numbers({0}));
  CHECK(flaw_of(Datagram(kSender).data(kParticipantReader, kParticipantWriter, 1, list), true) ==
        Flaw::kNone);
  for (const std::uint32_t lease : {0U, 4U, 0xFFFFFFFFU}) {
    const Bytes lost = announcement(0x0002, numbers({lease, 0}));
    const Datagram said = Datagram(kSender).data(kParticipantReader, kParticipantWriter, 1, lost);
    CHECK(flaw_of(said, true) == Flaw::kNumber);
    CHECK(flaw_of(said) == Flaw::kNone);
  }
  // No announcement is so large that it comes in fragments.
  const Datagram parts =
      from_sender().fragment(kParticipantReader, kParticipantWriter, 1, 1, 1, 100, 200, 100);
  CHECK(flaw_of(parts) == Flaw::kLength);
}

TEST_CASE("datagrams: there is room for a participant, whoever announces it") {
  Bytes guid{9, 9, 9};
  guid.resize(16);
  const Bytes list = announcement(0x0050, guid);
  for (const bool secured : {false, true}) {
    Claims claims;
    const Bytes bytes =
        Datagram(kSender).data(kParticipantReader, kParticipantWriter, 1, list).bytes();
    for (const Flaw flaw : {Flaw::kNone, Flaw::kNone, Flaw::kCrowd}) {
      CHECK(check_datagram(bytes.data(), bytes.size(), secured, claims) == flaw);
    }
    CHECK(claims.participants[0] == NumberClaim::Prefix{9, 9, 9});
  }
}

TEST_CASE("datagrams: any bytes are read within their end") {
  testing::Random random(GENERATE(1U, 2U, 3U));
  INFO("seed " << random.seed());
  const Datagram whole = from_sender()
                             .heartbeat(kUserReader, kUserWriter, 3, 8, 42)
                             .fragment(kUserReader, kUserWriter, 1, 1, 1, 100, 200, 100)
                             .gap(kUserReader, kUserWriter, 3, 9);
  for (int i = 0; i < 20'000; ++i) {
    Bytes bytes = whole.bytes();
    for (int changes = 0; changes < 3; ++changes) {
      bytes[random.index(bytes.size())] = static_cast<std::uint8_t>(random.index(256));
    }
    // A copy of its own, so that AddressSanitizer sees its end.
    const Bytes cut(bytes.begin(),
                    bytes.begin() + static_cast<std::ptrdiff_t>(random.index(bytes.size() + 1)));
    Claims claims;
    const Flaw flaw = check_datagram(cut.data(), cut.size(), random.index(2) == 0, claims);
    for (const NumberClaim& claim : claims.all) {
      CHECK(claim.last + 1 >= claim.first);
      CHECK(claim.last - claim.first + 1 <= kLongestRange + 256);
    }
    CHECK((flaw == Flaw::kNone) == std::string(to_string(flaw)).empty());
  }
}

TEST_CASE("rtps check: a farewell is what its participant would send") {
  const Farewells::Datagram said = Farewells::farewell_of(kSender);
  const Bytes farewell(said.begin(), said.end());
  CHECK(flaw_of(farewell) == Flaw::kNone);
  CHECK(flaw_of(farewell, true) == Flaw::kFarewell);
  CHECK(std::equal(kSender.begin(), kSender.end(), farewell.begin() + 8));
  // The length of its one submessage.
  CHECK(farewell.size() == 20U + 4U + farewell[22]);
}

}  // namespace tfdude::fastdds
