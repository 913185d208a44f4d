#include <string>
#include <utility>

#include "tfdude/base/id.hpp"

#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/fields.hpp"

// Pages and presences.
namespace tfdude::fastdds {
namespace {

// Of the partition that the message is about.
struct Incarnation : Count64 {
  template <class Message>
  static void write(const Message& message, std::uint64_t& wire) {
    wire = message.incarnation;
  }
  template <class Message>
  static Result<void> read(std::uint64_t wire, Message& message, const Place&) {
    if (wire != 0) return kIncarnation.read(wire, message.incarnation, {});
    return fail(Errc::kInvalidInput, "incarnation 0 of partition " + quote(message.partition));
  }
};

constexpr auto kPageEntry =
    record(TFDUDE_FIELD(lamport_time, lamport_time, kLamportTime), TFDUDE_FIELD(id, id, Id("id")),
           TFDUDE_FIELD(parent, parent, Id("parent", true)));

constexpr auto kTombstone =
    record(TFDUDE_FIELD(lamport_time, lamport_time, kLamportTime),
           TFDUDE_FIELD(kind, kind, Enumerated(Tombstone::Kind::kDropped, "a tombstone")),
           TFDUDE_FIELD(id, id, Id("id")), TFDUDE_FIELD(rival, rival, PartitionName(true)));

constexpr auto kPageEpoch =
    record(TFDUDE_FIELD(epoch, epoch, kEpoch), TFDUDE_FIELD(number, number, Count32()));

constexpr auto kPageJoint = record(TFDUDE_FIELD(name, name, Id("joint")),
                                   TFDUDE_FIELD(follows, follows, Id("joint", true)));

constexpr auto kPage = record(
    TFDUDE_FIELD(partition, partition, PartitionName()), TFDUDE_FIELD(number, number, Count32()),
    TFDUDE_FIELD_OF_ALL(incarnation, Incarnation()), TFDUDE_FIELD(epoch, epoch, kEpoch),
    TFDUDE_FIELD(entries, entries, List(kPageEntry)),
    TFDUDE_FIELD(tombstones, tombstones, List(kTombstone)),
    TFDUDE_FIELD(others, others, List(kPageEpoch)), TFDUDE_FIELD(joints, joints, List(kPageJoint)));

constexpr auto kAbsent =
    record(TFDUDE_FIELD(since, since, Number<std::int64_t>()),
           TFDUDE_FIELD(incarnation, incarnation, kIncarnation),
           TFDUDE_FIELD(kind, kind, Enumerated(Absent::Kind::kForgotten, "an absence")),
           TFDUDE_FIELD(partition, partition, PartitionName()));

constexpr auto kPresence = record(
    TFDUDE_FIELD(partition, partition, PartitionName()),
    TFDUDE_FIELD_OF_ALL(incarnation, Incarnation()), TFDUDE_FIELD(host, host, Id("host")),
    TFDUDE_FIELD(pid, pid, Count32()), TFDUDE_FIELD(pages, pages, Count32()),
    TFDUDE_FIELD_OF_ALL(peers, NotOfMessage<std::uint32_t>()),
    TFDUDE_FIELD(serving, serving, Boolean()), TFDUDE_FIELD(absent, absent, List(kAbsent)),
    TFDUDE_FIELD(ticket, ticket, Count64()), TFDUDE_FIELD(taken, taken, Octet()),
    TFDUDE_FIELD(stopped, stopped, Octet()),
    TFDUDE_FIELD(major_version, protocol.major, Number<std::uint16_t>()),
    TFDUDE_FIELD(minor_version, protocol.minor, Number<std::uint16_t>()),
    TFDUDE_FIELD(program, program, Shown()), TFDUDE_FIELD(clock, clock, AtMostOne(Instant())));

}  // namespace

bool well_formed_page(const std::uint8_t* data, std::size_t size) {
  return well_formed(kPage, data, size);
}

void write_wire(const Page& page, wire::Page& sample) { kPage.write(page, sample); }

Result<Page> from_wire(const wire::Page& sample) { return read_as<Page>(kPage, sample, {}); }

bool well_formed_presence(const std::uint8_t* data, std::size_t size) {
  return well_formed(kPresence, data, size);
}

void write_wire(const Presence& presence, wire::Presence& sample) {
  kPresence.write(presence, sample);
}

Result<Presence> from_wire(const wire::Presence& sample) {
  return read_as<Presence>(kPresence, sample, {});
}

}  // namespace tfdude::fastdds
