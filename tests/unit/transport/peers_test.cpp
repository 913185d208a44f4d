#include "transport/fastdds/peers.hpp"

#include <chrono>
#include <thread>

#include "support/catch.hpp"

namespace tfdude::fastdds {
namespace {

ertps::GuidPrefix_t prefix_of(unsigned char number) {
  ertps::GuidPrefix_t prefix;
  prefix.value[0] = number;
  return prefix;
}

Presence presence_of(const std::string& partition) {
  return {partition, 1, "tower", 4711, 1, true};
}

}  // namespace

TEST_CASE("who was met counts as all there are only once its beats say how many it hears") {
  Peers peers([](const Presence&) {}, [](const Presence&) {});
  peers.configure(std::chrono::seconds(60), std::chrono::seconds(60), false);
  peers.met(prefix_of(1), participant_name("arms"));
  // As it was when it was written, before the sender had met anybody.
  peers.present(prefix_of(1), presence_of("arms"), 0, false);
  std::this_thread::sleep_for(Peers::kQuiet);
  REQUIRE_FALSE(peers.awaits_presence());
  CHECK_FALSE(peers.settled());
  SECTION("none") {
    peers.present(prefix_of(1), presence_of("arms"), 0, true);
    CHECK(peers.settled());
  }
  SECTION("another, who is to be met first") {
    peers.present(prefix_of(1), presence_of("arms"), 1, true);
    CHECK_FALSE(peers.settled());
    peers.met(prefix_of(2), participant_name("head"));
    peers.present(prefix_of(2), presence_of("head"), 1, true);
    std::this_thread::sleep_for(Peers::kQuiet);
    CHECK(peers.settled());
  }
}

}  // namespace tfdude::fastdds
