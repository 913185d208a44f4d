// Passes any bytes to a participant on the topic of presence.

#include <vector>

#include "fuzz/key.hpp"
#include "fuzz/wire.hpp"
#include "support/replica.hpp"

namespace tfdude::fuzz {
namespace {

void demand_known(const Presence& presence) {
  testing::Replica replica;
  replica.directory.apply(presence, Time{});
  const auto there = replica.directory.serving(presence.partition);
  const bool serves = presence.serving && !presence.stopped;
  demand(there.has_value() == serves, "who serves is there");
  const Presence said{presence.partition, presence.incarnation, presence.host,
                      presence.pid,       presence.pages,       true};
  demand(!there || *there == said, "a partition is known as it said");
  demand(replica.directory.lost(presence.partition, presence.incarnation, Time{}) == serves,
         "who was there can be lost");
  demand(!replica.directory.serving(presence.partition), "who was lost is not there");
}

// What a message does not keep, or only in another form.
void strip(wire::Presence& wire, const std::vector<fastdds::Numbers>&) {
  wire.peers(0);
  wire.taken(wire.taken() != 0 ? 1 : 0);
  wire.stopped(wire.stopped() != 0 ? 1 : 0);
  wire.program(printable(wire.program().c_str()));
}

void run(const Bytes& bytes) {
  const bool well_formed = fastdds::well_formed_presence(bytes.data(), bytes.size());
  auto sample = received<fastdds::PresenceType, wire::Presence>(bytes, well_formed);
  if (!sample) return;
  const Key key = key_of<fastdds::PresenceType>(*sample);
  const auto presence = round_trip<fastdds::PresenceType>(
      *sample, [](const Presence& message) { return fastdds::to_wire(message); },
      [](const wire::Presence& wire) { return fastdds::from_wire(wire); }, strip);
  if (!presence) return;
  wire::Presence sent = fastdds::to_wire(*presence);
  demand(key_of<fastdds::PresenceType>(sent) == key, "a presence keeps its key");
  demand_known(*presence);
}

}  // namespace
}  // namespace tfdude::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tfdude::fuzz::run({data, data + size});
  return 0;
}
