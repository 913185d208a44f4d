#include "transport/fastdds/endpoint_sets.hpp"

#include "support/catch.hpp"
#include "support/rtps_bytes.hpp"
#include "transport/fastdds/datagram_guard.hpp"
#include "transport/fastdds/farewells.hpp"

namespace tfdude::fastdds {
namespace {

using namespace std::chrono_literals;
using Entity = EndpointSets::Entity;

constexpr PeerId kPeer{1, 15, 7};
constexpr Entity kWriter{0, 0, 1, 2};
constexpr Entity kReader{0, 0, 2, 7};
constexpr Entity kLater{0, 0, 3, 2};

// A participant that announces itself every 300 ms, and one that hears it.
struct Pair {
  EndpointSets peer;
  EndpointSets here;
  EndpointSets::Clock::time_point now{1h};

  Pair() {
    here.found(kPeer);
    for (const Entity& endpoint : {kWriter, kReader}) create(endpoint);
  }
  void create(const Entity& endpoint) {
    peer.created(endpoint);
    here.found(kPeer, endpoint, 1);
  }
  [[nodiscard]] std::vector<std::uint8_t> announcement() const {
    const testing::Datagram::Bytes list{0, 3, 0, 0, 1, 0, 0, 0};
    const auto plain = testing::Datagram(kPeer).data(testing::kParticipantReader,
                                                     testing::kParticipantWriter, 1, list);
    return peer.with_own(plain.bytes().data(), plain.bytes().size());
  }
  bool hear() {
    const auto bytes = announcement();
    return here.contradicts(bytes.data(), bytes.size(), now);
  }
  // How many announcements it takes until the peer is to be discovered anew; 0: more.
  int announcements(int most = 40) {
    for (int i = 1; i <= most; ++i) {
      now += 300ms;
      if (hear()) return i;
    }
    return 0;
  }
};

}  // namespace

TEST_CASE("endpoint sets: who is known as it says is left alone") {
  Pair pair;
  CHECK(pair.announcements() == 0);
  pair.create(kLater);
  CHECK(pair.announcements() == 0);
  pair.peer.deleted(kWriter);
  pair.here.lost(kPeer, kWriter);
  CHECK(pair.announcements() == 0);
}

// How many announcements it takes if something was lost here.
constexpr int kAfterLoss = static_cast<int>(EndpointSets::kAfterLoss / 300ms);

TEST_CASE("endpoint sets: an endpoint that is said to be gone, and is not, is discovered anew") {
  for (const Entity& endpoint : {kWriter, kReader}) {
    Pair pair;
    CHECK_FALSE(pair.hear());
    pair.here.lost(kPeer, endpoint);
    CHECK_FALSE(pair.hear());
    pair.now += 1ms;  // the same announcement, by another way
    CHECK_FALSE(pair.hear());
    CHECK(pair.announcements() == kAfterLoss);
  }
}

TEST_CASE("endpoint sets: other endpoints that come and go hide no lie") {
  Pair pair;
  pair.here.lost(kPeer, kReader);
  CHECK_FALSE(pair.hear());
  pair.create(kLater);
  pair.peer.deleted(kWriter);
  pair.here.lost(kPeer, kWriter);
  CHECK(pair.announcements() == kAfterLoss);
}

TEST_CASE("endpoint sets: an endpoint that others made up, or whose news were lost, takes longer") {
  const auto patience = static_cast<int>(EndpointSets::kOtherwise / 300ms);
  Pair made_up;
  made_up.here.found(kPeer, kLater, 1);
  CHECK(made_up.announcements() == patience + 1);
  Pair missed;
  missed.peer.created(kLater);
  CHECK(missed.announcements(patience) == 0);
  missed.here.found(kPeer, kLater, 1);
  CHECK(missed.announcements() == 0);
}

TEST_CASE("endpoint sets: settings of an endpoint do not change") {
  Pair pair;
  pair.here.found(kPeer, kWriter, 1);  // announced again
  CHECK(pair.announcements() == 0);
  pair.here.found(kPeer, kWriter, 2);
  pair.here.found(kPeer, kWriter, 1);
  CHECK(pair.announcements() == kAfterLoss + 1);
}

TEST_CASE("endpoint sets: what was gone does not come back otherwise") {
  Pair pair;
  pair.here.lost(kPeer, kWriter);
  pair.here.found(kPeer, kWriter, 2);
  CHECK(pair.announcements() == kAfterLoss + 1);
}

TEST_CASE("endpoint sets: who cannot be known is discovered anew ever more rarely") {
  Pair pair;
  int times = 0;
  int last = 0;
  for (int announcement = 1; announcement <= 12'000; ++announcement) {  // an hour
    pair.now += 300ms;
    if (announcement == 1) pair.here.lost(kPeer, kWriter);
    if (!pair.hear()) continue;
    ++times;
    last = announcement;
    CHECK(pair.here.left(kPeer));
    pair.here.found(kPeer);
    pair.here.found(kPeer, kReader, 1);
  }
  CHECK(times < 30);
  CHECK(last > 6000);
}

TEST_CASE("endpoint sets: one that left, or is not known, is not compared") {
  Pair pair;
  CHECK_FALSE(pair.here.left(kPeer));
  CHECK(pair.announcements() == 0);
}

TEST_CASE("endpoint sets: only announcements say which endpoints there are") {
  Pair pair;
  pair.here.lost(kPeer, kWriter);
  const auto farewell = Farewells::farewell_of(kPeer);
  const auto said = pair.peer.with_own(farewell.data(), farewell.size());
  for (int i = 0; i < 5; ++i) {
    pair.now += 300ms;
    CHECK_FALSE(pair.here.contradicts(said.data(), said.size(), pair.now));
    for (std::size_t size = 0; size < said.size(); ++size) {
      CHECK_FALSE(pair.here.contradicts(said.data(), size, pair.now));
    }
  }
}

TEST_CASE("endpoint sets: the check of datagrams admits an announcement with endpoints") {
  DatagramGuard guard(false);
  const auto bytes = Pair().announcement();
  bool admitted = false;
  guard.receive(
      bytes.data(), bytes.size(), DatagramGuard::Clock::time_point{1h}, [] { return ""; },
      [&](const DatagramGuard::Bytes*, std::size_t) { admitted = true; });
  CHECK(admitted);
}

}  // namespace tfdude::fastdds
