#include <utility>

#include "tfdude/base/id.hpp"

#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/codec_correlation.hpp"

// Converts the structure for the network, and from it.
namespace tfdude::fastdds {
namespace {

Result<Tombstone> read_tombstone(const wire::Tombstone& sample) {
  constexpr auto kLast = static_cast<std::uint8_t>(Tombstone::Kind::kDropped);
  if (sample.kind() < 1 || sample.kind() > kLast) {
    return fail(Errc::kInvalidInput,
                "unknown kind " + std::to_string(sample.kind()) + " of a tombstone");
  }
  Tombstone tombstone{string_of(sample.id()), sample.lamport_time(),
                      static_cast<Tombstone::Kind>(sample.kind()), string_of(sample.rival())};
  if (auto ok = check_id(tombstone.id, "id"); !ok) return tl::unexpected(std::move(ok.error()));
  if (!tombstone.rival.empty()) {
    if (auto ok = check_partition_name(tombstone.rival); !ok) return tl::unexpected(ok.error());
  }
  return tombstone;
}

Result<void> check_incarnation(std::uint64_t incarnation, const std::string& partition) {
  if (incarnation != 0) return {};
  return fail(Errc::kInvalidInput, "incarnation 0 of partition " + quote(partition));
}

}  // namespace

Result<Page> from_wire(const wire::Page& sample) {
  Page page{string_of(sample.partition()),
            sample.number(),
            sample.incarnation(),
            sample.epoch(),
            {},
            {},
            {},
            {}};
  if (auto ok = check_partition_name(page.partition); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  if (auto ok = check_incarnation(page.incarnation, page.partition); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  page.entries.reserve(sample.entries().size());
  for (const wire::PageEntry& entry : sample.entries()) {
    PageEntry read{string_of(entry.id()), string_of(entry.parent()), entry.lamport_time()};
    if (auto ok = check_id(read.id, "id"); !ok) return tl::unexpected(std::move(ok.error()));
    if (!read.parent.empty()) {
      if (auto ok = check_id(read.parent, "parent"); !ok)
        return tl::unexpected(std::move(ok.error()));
    }
    page.entries.push_back(std::move(read));
  }
  page.tombstones.reserve(sample.tombstones().size());
  for (const wire::Tombstone& tombstone : sample.tombstones()) {
    auto read = read_tombstone(tombstone);
    if (!read) return tl::unexpected(std::move(read.error()));
    page.tombstones.push_back(*std::move(read));
  }
  for (const wire::PageEpoch& one : sample.others()) {
    page.others.push_back({one.number(), one.epoch()});
  }
  for (const wire::PageJoint& one : sample.joints()) {
    PageJoint joint{string_of(one.name()), string_of(one.follows())};
    if (auto ok = check_id(joint.name, "joint"); !ok) return tl::unexpected(std::move(ok.error()));
    if (auto ok = check_id(joint.follows, "joint"); !joint.follows.empty() && !ok) {
      return tl::unexpected(std::move(ok.error()));
    }
    page.joints.push_back(std::move(joint));
  }
  return page;
}

Result<Presence> from_wire(const wire::Presence& sample) {
  Presence presence{string_of(sample.partition()),
                    sample.incarnation(),
                    std::string(sample.host().c_str()),
                    sample.pid(),
                    sample.pages(),
                    sample.serving(),
                    {},
                    sample.taken() != 0,
                    sample.stopped() != 0,
                    sample.ticket(),
                    {sample.major_version(), sample.minor_version()},
                    printable(sample.program().c_str())};
  if (auto ok = check_partition_name(presence.partition); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  if (auto ok = check_incarnation(presence.incarnation, presence.partition); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  if (auto ok = check_id(presence.host, "host"); !ok) return tl::unexpected(std::move(ok.error()));
  if (!sample.clock().empty()) presence.clock = time_of(sample.clock().front());
  for (const wire::Absent& one : sample.absent()) {
    const auto kind = static_cast<Absent::Kind>(one.kind());
    if (kind < Absent::Kind::kSilent || kind > Absent::Kind::kForgotten) {
      return fail(Errc::kInvalidInput,
                  "unknown kind " + std::to_string(one.kind()) + " of an absence");
    }
    presence.absent.push_back({string_of(one.partition()), one.since(), kind, one.incarnation()});
    if (auto ok = check_partition_name(presence.absent.back().partition); !ok) {
      return tl::unexpected(std::move(ok.error()));
    }
  }
  return presence;
}

wire::Page to_wire(const Page& page) {
  wire::Page sample;
  sample.partition(page.partition);
  sample.number(page.number);
  sample.incarnation(page.incarnation);
  sample.epoch(page.epoch);
  sample.entries().resize(page.entries.size());
  for (std::size_t i = 0; i < page.entries.size(); ++i) {
    sample.entries()[i].id(page.entries[i].id);
    sample.entries()[i].parent(page.entries[i].parent);
    sample.entries()[i].lamport_time(page.entries[i].lamport_time);
  }
  sample.tombstones().resize(page.tombstones.size());
  for (std::size_t i = 0; i < page.tombstones.size(); ++i) {
    sample.tombstones()[i].id(page.tombstones[i].id);
    sample.tombstones()[i].lamport_time(page.tombstones[i].lamport_time);
    sample.tombstones()[i].kind(static_cast<std::uint8_t>(page.tombstones[i].kind));
    sample.tombstones()[i].rival(page.tombstones[i].rival);
  }
  sample.others().resize(page.others.size());
  for (std::size_t i = 0; i < page.others.size(); ++i) {
    sample.others()[i].number(page.others[i].number);
    sample.others()[i].epoch(page.others[i].epoch);
  }
  sample.joints().resize(page.joints.size());
  for (std::size_t i = 0; i < page.joints.size(); ++i) {
    sample.joints()[i].name(page.joints[i].name);
    sample.joints()[i].follows(page.joints[i].follows);
  }
  return sample;
}

wire::Presence to_wire(const Presence& presence) {
  wire::Presence sample;
  sample.partition(presence.partition);
  sample.incarnation(presence.incarnation);
  sample.host(presence.host);
  sample.pid(presence.pid);
  sample.pages(presence.pages);
  sample.serving(presence.serving);
  sample.absent().resize(presence.absent.size());
  for (std::size_t i = 0; i < presence.absent.size(); ++i) {
    sample.absent()[i].partition(presence.absent[i].partition);
    sample.absent()[i].since(presence.absent[i].since);
    sample.absent()[i].kind(static_cast<std::uint8_t>(presence.absent[i].kind));
    sample.absent()[i].incarnation(presence.absent[i].incarnation);
  }
  sample.taken(presence.taken ? 1 : 0);
  sample.stopped(presence.stopped ? 1 : 0);
  sample.ticket(presence.ticket);
  sample.major_version(presence.protocol.major);
  sample.minor_version(presence.protocol.minor);
  sample.program(presence.program);
  if (presence.clock) sample.clock({nanoseconds(*presence.clock)});
  return sample;
}

}  // namespace tfdude::fastdds
