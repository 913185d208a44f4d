// Sequences of messages: how long they may be, and that all of their elements are there.

#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/well_formed.hpp"

namespace tfdude::fastdds {
namespace {

using testing::Cdr;
using namespace testing::well_formed;  // NOLINT(google-build-using-namespace): short predicates

// A sample of each sequence, with `count` elements and a length field of `length`.
Cdr edges(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.ulong(length);
  for (std::size_t i = 0; i < count; ++i) cdr.edge("e");
  return cdr.ulonglong(0);
}
Cdr tops(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.head("hand").octet(2).ulong(length);
  for (std::size_t i = 0; i < count; ++i) cdr.string("t");
  return cdr.ulonglong(0);
}
Cdr more_edges(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.head("hand").octet(3).transform().ulonglong(0).ulong(length);
  for (std::size_t i = 0; i < count; ++i) cdr.edge("e");
  return cdr;
}
Cdr segments(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.head("hand").octet(6).ulong(length);
  for (std::size_t i = 0; i < count; ++i) cdr.string("a").string("b");
  return cdr;
}
Cdr segments_at(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.head("hand").octet(7).ulonglong(1).ulonglong(2).ulonglong(3).ulonglong(4).ulong(length);
  for (std::size_t i = 0; i < count; ++i) cdr.string("a").string("b");
  return cdr.octet(2).octet(0);
}
Cdr watched(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.head("hand").octet(8).ulonglong(1).ulonglong(2).ulong(length);
  for (std::size_t i = 0; i < count; ++i) cdr.string("a").string("b");
  return cdr.octet(0);
}
Cdr stamped(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.ulonglong(0).ulonglong(0).ulong(0).octet(4).ulonglong(1).ulonglong(2).ulong(length);
  for (std::size_t i = 0; i < count; ++i) cdr.transform();
  return cdr.ulong(0);
}
Cdr at_hint(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.ulonglong(0).ulonglong(0).ulong(0).octet(4).ulonglong(1).ulonglong(2).ulong(0).ulong(length);
  for (std::size_t i = 0; i < count; ++i) cdr.transform();
  return cdr;
}
Cdr state_entries(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.ulonglong(0).ulonglong(0).ulonglong(0).ulong(0).ulong(1).ulong(length);
  for (std::size_t i = 0; i < count; ++i)
    cdr.ulonglong(1).ulonglong(2).ulong(3).ulong(0).transform();
  return cdr.ulong(0).ulong(0);
}
Cdr replied_entries(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.ulonglong(0).ulonglong(0).ulong(0).octet(5);
  cdr.ulonglong(0).ulonglong(0).ulonglong(0).ulong(0).ulong(1).ulong(length);
  for (std::size_t i = 0; i < count; ++i)
    cdr.ulonglong(1).ulonglong(2).ulong(3).ulong(0).transform();
  return cdr.ulong(0).ulong(0);
}
Cdr histories(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.ulonglong(0).ulonglong(0).ulong(0).octet(6).ulong(length);
  for (std::size_t i = 0; i < count; ++i) {
    for (int field = 0; field < 12; ++field) cdr.ulonglong(1);
    cdr.string("a");
  }
  return cdr;
}
Cdr transforms(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.ulonglong(0).ulonglong(0).ulong(0).octet(2).ulong(length);
  for (std::size_t i = 0; i < count; ++i) cdr.transform();
  return cdr;
}
Cdr entries(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.string("robot").ulong(0).ulonglong(0).ulonglong(0).ulong(length);
  for (std::size_t i = 0; i < count; ++i) cdr.ulonglong(7).string("a").string("b");
  return cdr.ulong(0).ulong(0).ulong(0);
}
Cdr tombstones(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.string("robot").ulong(0).ulonglong(0).ulonglong(0).ulong(0).ulong(length);
  for (std::size_t i = 0; i < count; ++i) cdr.ulonglong(7).octet(1).string("a").string("b");
  return cdr.ulong(0).ulong(0);
}
Cdr others(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.string("robot").ulong(0).ulonglong(0).ulonglong(0).ulong(0).ulong(0).ulong(length);
  for (std::size_t i = 0; i < count; ++i) cdr.ulonglong(7).ulong(3);
  return cdr.ulong(0);
}
Cdr page_joints(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.string("robot").ulong(0).ulonglong(0).ulonglong(0).ulong(0).ulong(0).ulong(0).ulong(length);
  for (std::size_t i = 0; i < count; ++i) cdr.string("a").string("");
  return cdr;
}
Cdr positions(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.ulong(length);
  for (std::size_t i = 0; i < count; ++i) cdr.string("elbow").numbers(2);
  return cdr.ulonglong(0);
}
Cdr asked_positions(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.head("arm").octet(12).ulong(length);
  for (std::size_t i = 0; i < count; ++i) cdr.string("elbow").numbers(2);
  return cdr.ulonglong(0);
}
Cdr joint_states(std::size_t count, std::uint64_t length) {
  Cdr cdr;
  cdr.ulonglong(0).ulonglong(0).ulong(0).octet(9).ulong(length);
  for (std::size_t i = 0; i < count; ++i) {
    for (int field = 0; field < 7; ++field) cdr.ulonglong(1);
    cdr.octet(1).octet(0).octet(1).string("elbow").string("forearm").string("").numbers(1);
  }
  return cdr;
}

Cdr absent(std::size_t count, std::uint64_t length) {
  Cdr cdr = presence_from("h", 1);
  cdr.ulong(length);
  for (std::size_t i = 0; i < count; ++i) cdr.ulonglong(7).ulonglong(8).octet(1).string("a");
  return presence_end(cdr);
}

TEST_CASE("a sequence has at most 4096 elements and all of them") {
  struct Sequence {
    const char* name;
    Cdr (*sample)(std::size_t count, std::uint64_t length);
    bool (*well_formed)(const Cdr& cdr);
  };
  const std::vector<Sequence> all{{"edges of an update", edges, update},
                                  {"tops of a remove", tops, request},
                                  {"further edges of an update", more_edges, request},
                                  {"segments of a lookup", segments, request},
                                  {"segments of a lookup at an instant", segments_at, request},
                                  {"watched segments", watched, request},
                                  {"transforms of a reply", transforms, reply},
                                  {"stamped transforms of a reply", stamped, reply},
                                  {"transforms at a hint", at_hint, reply},
                                  {"entries of a state", state_entries, state},
                                  {"entries of a replied state", replied_entries, reply},
                                  {"histories", histories, reply},
                                  {"entries of a page", entries, page},
                                  {"tombstones of a page", tombstones, page},
                                  {"other pages of a page", others, page},
                                  {"joints of a page", page_joints, page},
                                  {"joints of an update", positions, joints},
                                  {"joints of a request", asked_positions, request},
                                  {"joint states of a reply", joint_states, reply},
                                  {"absent ones of a presence", absent, presence}};
  for (const Sequence& sequence : all) {
    INFO(sequence.name);
    CHECK(sequence.well_formed(sequence.sample(0, 0)));
    CHECK(sequence.well_formed(sequence.sample(3, 3)));
    CHECK(sequence.well_formed(sequence.sample(4096, 4096)));
    CHECK_FALSE(sequence.well_formed(sequence.sample(4097, 4097)));
    for (const std::uint64_t length : {5U, 4096U, 0x10000U, 0x80000000U, 0xffffffffU}) {
      CHECK_FALSE(sequence.well_formed(sequence.sample(3, length)));
    }
  }
}

}  // namespace
}  // namespace tfdude::fastdds
