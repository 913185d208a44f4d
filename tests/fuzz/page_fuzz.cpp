// Passes any bytes to a participant on the topic of the directory.

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "fuzz/key.hpp"
#include "fuzz/plain_claims.hpp"
#include "fuzz/wire.hpp"
#include "support/replica.hpp"

namespace tfdude::fuzz {
namespace {

void demand_known(const Page& page) {
  testing::Replica replica;
  PlainClaims plain(false);
  (void)plain.apply(page);
  std::set<std::string> ids;
  for (const PageEntry& entry : page.entries) ids.insert(entry.id);
  const bool alone = std::all_of(page.others.begin(), page.others.end(), [&](const PageEpoch& one) {
    return one.number == page.number && one.epoch <= page.epoch;
  });
  for (int times = 0; times < 2; ++times) {
    replica.directory.apply(page);
    const auto owner = replica.directory.owner(page.partition);
    demand(owner && *owner != kHeldHere, "who says what it owns is known");
    demand(replica.directory.epoch(*owner) == (alone ? page.epoch : 0),
           "a page completes its epoch where it needs no other");
    demand(replica.directory.info(*owner).frames == ids.size(), "frames are counted once");
    demand(replica.forest.frames().size() == ids.size(), "all frames of a page are there");
  }
  demand_shows(replica.forest, replica.directory, without_cycles(plain.oldest()));
  const std::uint64_t next = replica.directory.next_lamport_time(Time{});
  for (const PageEntry& entry : page.entries) {
    demand(next > entry.lamport_time || entry.lamport_time >= kLastCounter,
           "a Lamport time is later than all seen");
  }
  Page later{page.partition, page.number, page.incarnation, page.epoch, {}};
  replica.directory.apply(later);
  demand(replica.forest.frames().empty(), "a frame that no page lists is gone");
}

void run(const Bytes& bytes) {
  const bool well_formed = fastdds::well_formed_page(bytes.data(), bytes.size());
  auto sample = received<fastdds::PageType, wire::Page>(bytes, well_formed);
  if (!sample) return;
  const Key key = key_of<fastdds::PageType>(*sample);
  const auto page = round_trip<fastdds::PageType>(
      *sample, [](const Page& message) { return fastdds::to_wire(message); },
      [](const wire::Page& wire) { return fastdds::from_wire(wire); },
      [](const wire::Page&, const std::vector<fastdds::Numbers>&) {});
  if (!page) return;
  wire::Page sent = fastdds::to_wire(*page);
  demand(key_of<fastdds::PageType>(sent) == key, "a page keeps its key");
  demand_known(*page);
}

}  // namespace
}  // namespace tfdude::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tfdude::fuzz::run({data, data + size});
  return 0;
}
