// Whether bytes are well formed, and what filters read of them.

#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/cdr.hpp"
#include "support/random.hpp"
#include "support/samples.hpp"
#include "support/well_formed.hpp"

namespace tfdude::fastdds {
namespace {

using testing::Bytes;
using testing::Cdr;
using testing::Random;
using testing::wire_kinds;
using testing::WireKind;
using namespace testing::well_formed;  // NOLINT(google-build-using-namespace): short predicates

bool passes(const WireKind& kind, const Bytes& bytes) {
  const bool well_formed = kind.well_formed(bytes.data(), bytes.size());
  // The type must say the same, and take without an exception what it accepts.
  return kind.take(bytes) == well_formed ? well_formed : throw std::logic_error("they differ");
}

// ---- samples of all kinds

TEST_CASE("a valid sample of every kind passes") {
  Random random(0xcd1);
  INFO("seed " << random.seed());
  for (const WireKind& kind : wire_kinds(random)) {
    INFO(kind.name);
    REQUIRE(kind.valid.size() > 4);
    CHECK(passes(kind, kind.valid));
  }
}

TEST_CASE("every truncated sample is rejected") {
  Random random(0xcd2);
  INFO("seed " << random.seed());
  for (const WireKind& kind : wire_kinds(random)) {
    for (std::size_t size = 0; size < kind.valid.size(); ++size) {
      INFO(kind.name << " cut to " << size << " of " << kind.valid.size());
      const auto cut = kind.valid.begin() + static_cast<std::ptrdiff_t>(size);
      REQUIRE_FALSE(passes(kind, Bytes(kind.valid.begin(), cut)));
    }
  }
}

TEST_CASE("a mutated sample that passes can be deserialized") {
  Random random(0xcd3);
  INFO("seed " << random.seed());
  const auto kinds = wire_kinds(random);
  // Values that mean something as a length, a discriminator or a boolean.
  const Bytes telling{0, 1, 2, 3, 4, 5, 6, 7, 8, 0x10, 0x7f, 0x80, 0xfe, 0xff};
  std::size_t passed = 0;
  std::size_t refused = 0;
  for (int i = 0; i < 20000; ++i) {
    const WireKind& kind = kinds[random.index(kinds.size())];
    Bytes bytes = kind.valid;
    // Any number is well-formed, and most of a sample is numbers: half of the changes hit its head.
    const std::size_t reach =
        random.index(2) == 0 ? bytes.size() : std::min<std::size_t>(bytes.size(), 48);
    for (std::size_t changes = 1 + random.index(3); changes > 0; --changes) {
      bytes[random.index(reach)] = random.index(2) == 0
                                       ? telling[random.index(telling.size())]
                                       : static_cast<std::uint8_t>(random.index(256));
    }
    INFO("change " << i << " of " << kind.name);
    ++(passes(kind, bytes) ? passed : refused);
  }
  CHECK(passed > 1000);
  CHECK(refused > 1000);
}

TEST_CASE("random bytes are rejected or can be deserialized") {
  Random random(0xcd4);
  INFO("seed " << random.seed());
  const auto kinds = wire_kinds(random);
  std::size_t passed = 0;
  std::size_t refused = 0;
  for (int i = 0; i < 15000; ++i) {
    Bytes bytes(random.index(200));
    for (std::uint8_t& byte : bytes) {
      byte = static_cast<std::uint8_t>(random.index(random.index(2) == 0 ? 4 : 256));
    }
    // With a header that is right, so that there is a body to look at.
    if (bytes.size() >= 2 && random.index(8) > 0) bytes[0] = 0;
    if (bytes.size() >= 2 && random.index(8) > 0) bytes[1] = static_cast<std::uint8_t>(i % 2);
    const WireKind& kind = kinds[random.index(kinds.size())];
    INFO("try " << i << " as " << kind.name);
    ++(passes(kind, bytes) ? passed : refused);
  }
  CHECK(passed > 10);
  CHECK(refused > 1000);
}

// ---- the header

TEST_CASE("only plain CDR passes in both byte orders") {
  for (const bool big_endian : {false, true}) {
    Cdr cdr(big_endian);
    cdr.ulong(1).edge("hand").ulonglong(7);
    CHECK(update(cdr));
    wire::Update sample;
    REQUIRE(testing::deserialized<UpdateType>(cdr.bytes(), sample));
    REQUIRE(sample.edges().size() == 1);
    CHECK(std::string(sample.edges()[0].id().c_str()) == "hand");
  }
  for (const unsigned kind : {2U, 3U, 6U, 7U, 255U}) {
    Bytes bytes = Cdr().ulong(0).bytes();
    bytes[1] = static_cast<std::uint8_t>(kind);
    CHECK_FALSE(well_formed_update(bytes.data(), bytes.size()));
    bytes[1] = 1;
    bytes[0] = static_cast<std::uint8_t>(kind);
    CHECK_FALSE(well_formed_update(bytes.data(), bytes.size()));
  }
  CHECK_FALSE(well_formed_update(nullptr, 0));
  CHECK_FALSE(well_formed_update(nullptr, 100));
}

// ---- strings

TEST_CASE("an id has at most 255 bytes and no zero but the last one") {
  const auto move = [](const Cdr& id) {
    Cdr cdr(id);
    return request(cdr.ulong(0).ulong(0).ulonglong(0).octet(4).string("arm").ulonglong(0));
  };
  CHECK(move(Cdr().string("hand")));
  CHECK(move(Cdr().string("")));
  CHECK(move(Cdr().string(std::string(255, 'h'))));
  CHECK_FALSE(move(Cdr().string(std::string(256, 'h'))));
  CHECK_FALSE(move(Cdr().string(std::string("ha\0nd", 5))));
  CHECK_FALSE(move(Cdr().ulong(4).octet('h').octet('a').octet('n').octet('d')));  // no zero
  CHECK_FALSE(move(Cdr().string("hand", 0xffffffff)));
  CHECK_FALSE(move(Cdr().string("hand", 0x80000000)));
}

TEST_CASE("the message of an error has at most 4096 bytes") {
  const auto error = [](const std::string& message) {
    return reply(Cdr().ulonglong(0).ulonglong(0).ulong(0).octet(1).octet(9).string(message));
  };
  CHECK(error(std::string(4096, 'm')));
  CHECK_FALSE(error(std::string(4097, 'm')));
}

TEST_CASE("the name of a host has at most 255 bytes") {
  const auto host = [](const std::string& name) {
    return presence(presence_end(presence_from(name, 1).ulong(0)));
  };
  CHECK(host(std::string(255, 'h')));
  CHECK_FALSE(host(std::string(256, 'h')));
}

// ---- kinds and booleans

TEST_CASE("unknown kinds of later versions are read up to their kind and rejected") {
  constexpr unsigned kLastRequestKind = 26;
  constexpr unsigned kLastReplyKind = 16;
  for (unsigned kind = 0; kind < 256; ++kind) {
    if (kind >= 1 && kind <= kLastRequestKind) continue;
    const Cdr cdr = Cdr().head("hand").octet(kind).string("arm");
    REQUIRE(request(cdr));
    wire::Request sample;
    REQUIRE(testing::deserialized<RequestType>(cdr.bytes(), sample));
    const auto read = from_wire(sample);
    REQUIRE_FALSE(read);
    CHECK(read.error().code == Errc::kUnsupported);
    CHECK(read.error().message == "this kind of request is not known to protocol 1.1");
  }
  for (unsigned kind = 0; kind < 256; ++kind) {
    if (kind >= 1 && kind <= kLastReplyKind) continue;
    const Cdr cdr = Cdr().ulonglong(7).ulonglong(0).ulong(9).octet(kind).octet(0);
    REQUIRE(reply(cdr));
    wire::Reply sample;
    REQUIRE(testing::deserialized<ReplyType>(cdr.bytes(), sample));
    CHECK(sample.sequence_number() == 9);
    const auto read = from_wire(sample);
    REQUIRE_FALSE(read);
    CHECK(read.error().code == Errc::kUnsupported);
  }
}

TEST_CASE("fields that a later version adds at the end of a message are ignored") {
  Random random(0xcd6);
  INFO("seed " << random.seed());
  for (const WireKind& kind : wire_kinds(random)) {
    INFO(kind.name);
    Bytes longer = kind.valid;
    longer.insert(longer.end(), 24, 7);
    REQUIRE(passes(kind, longer));
    CHECK(kind.take(longer));
  }
}

TEST_CASE("a boolean is zero or one") {
  const auto serving = [](unsigned value) {
    return presence(presence_end(presence_from("h", value).ulong(0)));
  };
  CHECK(serving(0));
  CHECK(serving(1));
  CHECK_FALSE(serving(2));
  CHECK_FALSE(serving(255));
}

// ---- what filters need

TEST_CASE("a filter reads the id and the addressee of a request of every kind") {
  Random random(0xcd5);
  INFO("seed " << random.seed());
  for (const Request& one : testing::requests(random)) {
    const Bytes bytes = testing::serialized<RequestType>(to_wire(one, "robot"));
    const auto head = read_request_head(bytes.data(), bytes.size());
    REQUIRE(head);
    CHECK(head->id == one.id);
    CHECK(head->addressee == addressee_of("robot"));
    CHECK_FALSE(well_formed_request(bytes.data(), bytes.size() - 1));
    const std::size_t head_size = Cdr().string(one.id).ulong(0).bytes().size();
    CHECK(read_request_head(bytes.data(), head_size));
    CHECK_FALSE(read_request_head(bytes.data(), head_size - 1));
  }
}

TEST_CASE("partitions are addressed by their FNV-1a hash") {
  CHECK(addressee_of("") == 0x811c9dc5U);
  CHECK(addressee_of("a") == 0xe40c292cU);
  CHECK(addressee_of("foobar") == 0xbf9cf968U);
}

TEST_CASE("a filter reads the edges of an update until one is owned") {
  const Bytes bytes = Cdr().ulong(3).edge("a").edge("b").edge("c").ulonglong(0).bytes();
  std::string seen;
  const auto owned = [&](const std::string& own) -> std::optional<bool> {
    seen.clear();
    return any_edge(bytes.data(), bytes.size(), [&](std::string_view id) {
      seen += id;
      return id == own;
    });
  };
  CHECK(owned("a") == true);
  CHECK(seen == "a");
  CHECK(owned("c") == true);
  CHECK(seen == "abc");
  CHECK(owned("d") == false);
  CHECK(seen == "abc");
  const auto cut = [&](bool accept, std::size_t size) {
    return any_edge(bytes.data(), size, [=](std::string_view) { return accept; });
  };
  CHECK(cut(false, bytes.size()) == false);
  CHECK_FALSE(cut(false, bytes.size() - 1));
  const std::size_t first = Cdr().ulong(3).edge("a").bytes().size();
  CHECK(cut(true, first) == true);  // all else is checked before it is deserialized
  CHECK_FALSE(cut(true, first - 1));
}

}  // namespace
}  // namespace tfdude::fastdds
