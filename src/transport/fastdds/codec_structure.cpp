#include <utility>

#include "tfdude/base/id.hpp"

#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/codec_correlation.hpp"

// Converts the structure from the network.
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

}  // namespace tfdude::fastdds
