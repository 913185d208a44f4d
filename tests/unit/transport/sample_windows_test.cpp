#include "transport/fastdds/sample_windows.hpp"

#include "support/catch.hpp"
#include "support/rtps_bytes.hpp"

namespace tfdude::fastdds {
namespace {

using testing::Datagram;

constexpr PeerId kPeer{1, 15, 7};
constexpr PeerId kSelf{1, 15, 8};
constexpr testing::Entity kOtherWriter{0, 0, 9, 2};
constexpr std::uint64_t kAhead = SampleWindows::kAhead;

struct Follower {
  SampleWindows windows;

  Follower() { windows.follow(kPeer, testing::kUserWriter); }

  bool admits(const Datagram& datagram) {
    return windows.admits(datagram.bytes().data(), datagram.bytes().size());
  }
  bool admits(std::uint64_t number) {
    return admits(Datagram(kPeer).data(testing::kUserReader, testing::kUserWriter, number,
                                       Datagram::Bytes(8)));
  }
  void acknowledge(std::uint64_t missing) {
    const auto datagram =
        Datagram(kSelf).to(kPeer).acknack(testing::kUserReader, testing::kUserWriter, missing);
    windows.sent(datagram.bytes().data(), datagram.bytes().size());
  }
};

}  // namespace

TEST_CASE("sample windows: what waits for an earlier sample is bounded") {
  Follower follower;
  follower.acknowledge(1);
  CHECK(follower.admits(1));
  CHECK(follower.admits(1 + kAhead));
  CHECK_FALSE(follower.admits(2 + kAhead));
  CHECK(follower.admits(2));
  CHECK(follower.admits(2 + kAhead));
  // What Fast DDS has does not go back.
  follower.acknowledge(1);
  CHECK(follower.admits(2 + kAhead));
  follower.acknowledge(1000);
  CHECK(follower.admits(999 + kAhead));
  CHECK_FALSE(follower.admits(1000 + kAhead));
}

TEST_CASE("sample windows: samples in order are admitted, however many") {
  Follower follower;
  follower.acknowledge(0);
  bool all = true;
  for (std::uint64_t number = 1; number < 10 * kAhead; ++number) {
    all = all && follower.admits(number);
  }
  CHECK(all);
}

TEST_CASE("sample windows: samples that do not exist are not waited for") {
  Follower follower;
  follower.acknowledge(1);
  CHECK_FALSE(follower.admits(5000));
  const auto gap = Datagram(kPeer).gap(testing::kUserReader, testing::kUserWriter, 1, 5000);
  CHECK(follower.admits(gap));
  CHECK(follower.admits(5000));
  // Also in one datagram, and if a gap comes too early.
  auto both = Datagram(kPeer).gap(testing::kUserReader, testing::kUserWriter, 5001, 9000);
  both.data(testing::kUserReader, testing::kUserWriter, 9000, Datagram::Bytes(8));
  CHECK(follower.admits(both));
  const auto early = Datagram(kPeer).gap(testing::kUserReader, testing::kUserWriter, 9500, 20'000);
  CHECK(follower.admits(early));
  CHECK_FALSE(follower.admits(20'000));
  const auto heartbeat =
      Datagram(kPeer).heartbeat(testing::kUserReader, testing::kUserWriter, 20'000, 20'001, 1);
  CHECK(follower.admits(heartbeat));
  CHECK(follower.admits(20'000));
}

TEST_CASE("sample windows: nothing is dropped of other writers, or before the first answer") {
  Follower follower;
  CHECK(follower.admits(1'000'000));
  follower.acknowledge(1);
  CHECK_FALSE(follower.admits(1'000'000));
  CHECK(follower.admits(
      Datagram(kPeer).data(testing::kUserReader, kOtherWriter, 1'000'000, Datagram::Bytes(8))));
  CHECK(follower.admits(Datagram(kSelf).data(testing::kUserReader, testing::kUserWriter, 1'000'000,
                                             Datagram::Bytes(8))));
  // What the peer acknowledges of a writer of this participant with the same number.
  CHECK(follower.admits(
      Datagram(kPeer).to(kSelf).acknack(testing::kUserReader, testing::kUserWriter, 1'000'000)));
  CHECK_FALSE(follower.admits(1'000'000));
  follower.windows.forget(kPeer, testing::kUserWriter);
  CHECK(follower.admits(1'000'000));
}

TEST_CASE("sample windows: what is sent is read within its size") {
  Follower follower;
  const auto datagram =
      Datagram(kSelf).to(kPeer).acknack(testing::kUserReader, testing::kUserWriter, 1);
  for (std::size_t size = 0; size < datagram.bytes().size(); ++size) {
    const std::vector<std::uint8_t> part(
        datagram.bytes().begin(), datagram.bytes().begin() + static_cast<std::ptrdiff_t>(size));
    follower.windows.sent(part.data(), part.size());
  }
  SUCCEED();
}

}  // namespace tfdude::fastdds
