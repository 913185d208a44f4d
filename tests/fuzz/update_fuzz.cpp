// Passes any bytes to a participant on the topic of updates.

#include <string_view>
#include <vector>

#include "fuzz/wire.hpp"

namespace tfdude::fuzz {
namespace {

void strip(wire::Update& sample, std::vector<fastdds::Numbers>& out) {
  for (wire::Edge& edge : sample.edges()) take_out(edge.x_pc(), out);
}

void demand_same_ids(const Bytes& bytes, const wire::Update& sample) {
  auto edge = sample.edges().begin();
  const auto differs = fastdds::any_edge(bytes.data(), bytes.size(), [&](std::string_view id) {
    return edge == sample.edges().end() || id != (edge++)->id().c_str();
  });
  demand(differs == false && edge == sample.edges().end(), "ids are read as the whole is");
}

void run(const Bytes& bytes) {
  const bool well_formed = fastdds::well_formed_update(bytes.data(), bytes.size());
  const auto sample = received<fastdds::UpdateType, wire::Update>(bytes, well_formed);
  if (!sample) return;
  demand_same_ids(bytes, *sample);
  const auto all = round_trip<fastdds::UpdateType>(
      *sample, [](const Update& message) { return fastdds::to_wire(message); },
      [](const wire::Update& wire) {
        return fastdds::from_wire(wire, [](std::string_view) { return true; });
      },
      strip);
  std::size_t wanted = 0;
  const auto some = fastdds::from_wire(*sample, [&wanted](std::string_view id) {
    const bool accepted = id == "hand";
    if (accepted) ++wanted;
    return accepted;
  });
  demand(some || !all, "an edge that nobody wants does no harm");
  demand(!some || some->edges.size() == wanted, "all edges come that somebody wants");
}

}  // namespace
}  // namespace tfdude::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tfdude::fuzz::run({data, data + size});
  return 0;
}
