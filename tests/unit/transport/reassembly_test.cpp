#include "transport/fastdds/reassembly.hpp"

#include <algorithm>
#include <cstring>

#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/rtps_bytes.hpp"
#include "transport/fastdds/datagram_guard.hpp"

namespace tfdude::fastdds {
namespace {

using namespace std::chrono_literals;
using testing::Datagram;
using testing::Random;

constexpr std::uint32_t kMega = 1U << 20U;

testing::Prefix sender(std::uint32_t n) {
  testing::Prefix prefix{1, 15};
  std::memcpy(prefix.data() + 4, &n, sizeof n);
  return prefix;
}

Datagram fragment(std::uint32_t from, std::uint64_t number, std::uint32_t first,
                  std::uint32_t sample, std::uint16_t each, std::uint16_t many = 1) {
  const std::size_t begin = std::size_t{first - 1} * each;
  const std::size_t carried = std::min<std::size_t>(sample - begin, std::size_t{each} * many);
  return Datagram(sender(from))
      .fragment(testing::kUserReader, testing::kUserWriter, number, first, many, each, sample,
                carried);
}

struct Received {
  DatagramGuard guard{false};
  DatagramGuard::Clock::time_point now{1h};
  std::vector<std::vector<Datagram::Bytes>> sets;

  std::size_t take(const Datagram& datagram) {
    const auto& bytes = datagram.bytes();
    const std::size_t before = sets.size();
    guard.receive(
        bytes.data(), bytes.size(), now, [] { return "a stranger"; },
        [&](const DatagramGuard::Bytes* all, std::size_t many) {
          auto& set = sets.emplace_back();
          for (std::size_t i = 0; i < many; ++i) {
            set.emplace_back(all[i].data, all[i].data + all[i].size);
          }
        });
    return sets.size() - before;
  }
};

}  // namespace

TEST_CASE("reassembly: Fast DDS has all fragments of a sample, or none") {
  Random random(20);
  INFO("seed " << random.seed());
  for (int run = 0; run < 200; ++run) {
    CAPTURE(run);
    Received received;
    const auto fragments = static_cast<std::uint32_t>(2 + random.index(38));
    const std::uint32_t sample = fragments * 100 - static_cast<std::uint32_t>(random.index(100));
    std::vector<std::uint32_t> order(fragments);
    for (std::uint32_t i = 0; i < fragments; ++i) order[i] = i + 1;
    std::shuffle(order.begin(), order.end(), random.engine());
    for (std::uint32_t i = 0; i < fragments; ++i) {
      CHECK(received.sets.empty());
      // Some come twice, and some of other sizes, as a stranger may send them.
      if (i > 0 && random.index(4) == 0) received.take(fragment(1, 7, order[i - 1], sample, 100));
      if (i > 0 && random.index(4) == 0) received.take(fragment(1, 7, order[i], sample + 100, 100));
      received.take(fragment(1, 7, order[i], sample, 100));
    }
    REQUIRE(received.sets.size() == 1);
    REQUIRE(received.sets[0].size() == fragments);
    for (std::uint32_t i = 0; i < fragments; ++i) {
      CHECK(received.sets[0][i] == fragment(1, 7, i + 1, sample, 100).bytes());
    }
  }
}

TEST_CASE("reassembly: what else is in a datagram comes at once, or behind the sample") {
  const auto with_others = [](std::uint32_t first) {
    Datagram datagram = Datagram(sender(1)).to(sender(9));
    datagram.fragment(testing::kUserReader, testing::kUserWriter, 7, first, 1, 100, 200, 100);
    datagram.heartbeat(testing::kUserReader, testing::kUserWriter, 1, 7, first);
    return datagram;
  };
  const auto heartbeat = [](std::uint32_t count) {
    return Datagram(sender(1)).to(sender(9)).heartbeat(testing::kUserReader, testing::kUserWriter,
                                                       1, 7, count);
  };
  Received received;
  CHECK(received.take(with_others(1)) == 1);
  CHECK(received.sets[0] == std::vector<Datagram::Bytes>{heartbeat(1).bytes()});
  CHECK(received.take(with_others(2)) == 2);
  REQUIRE(received.sets[1].size() == 2);
  CHECK(received.sets[1][0] ==
        Datagram(sender(1))
            .to(sender(9))
            .fragment(testing::kUserReader, testing::kUserWriter, 7, 1, 1, 100, 200, 100)
            .bytes());
  CHECK(received.sets[2] == std::vector<Datagram::Bytes>{heartbeat(2).bytes()});
}

TEST_CASE("reassembly: only one of two samples with one number is passed on") {
  Received received;
  CHECK(received.take(fragment(1, 7, 1, 300, 100)) == 0);
  CHECK(received.take(fragment(1, 7, 1, 200, 100, 2)) == 1);
  CHECK(received.take(fragment(1, 7, 2, 300, 100, 2)) == 0);
  CHECK(received.take(fragment(1, 7, 1, 200, 100, 2)) == 1);  // it is repeated
  CHECK(received.take(fragment(1, 8, 1, 300, 100, 3)) == 1);
}

TEST_CASE("reassembly: memory is that of what came, and bounded") {
  Reassembly kept;
  const Reassembly::Clock::time_point now{1h};
  const auto take = [&](std::uint32_t from, std::uint64_t number, std::uint32_t first,
                        std::uint32_t sample, std::uint16_t each, std::size_t bytes) {
    const NumberClaim claim{NumberClaim::Kind::kFragments,
                            sender(from),
                            testing::kUserWriter,
                            number,
                            number,
                            0,
                            sample,
                            each,
                            first,
                            1};
    return kept.take(claim, Reassembly::Datagram(bytes), now).size();
  };
  for (std::uint32_t from = 0; from < 60; ++from) {
    for (std::uint64_t number = 1; number <= 60; ++number) {
      take(from, number, 1, 16 * kMega, 64, 124);
    }
  }
  CHECK(kept.bytes() < 20 * kMega);
  // One that goes on growing is not dropped for them.
  for (std::uint32_t first = 1; first <= 100; ++first) {
    for (std::uint32_t from = 0; from < 60; ++from) take(from, 100 + first, 1, kMega, 1000, 1060);
    CHECK(take(99, 7, first, 100 * 60'000, 60'000, 60'060) == (first == 100 ? 100 : 0));
  }
  for (std::uint32_t from = 0; from < 900; ++from) {
    for (std::uint32_t first = 1; first < 4; ++first) take(from, 500, first, kMega, 60'000, 60'060);
  }
  CHECK(kept.bytes() <= Reassembly::kMostBytes);
}

TEST_CASE("reassembly: a writer that sends only parts keeps a few") {
  Received received;
  for (std::uint64_t number = 1; number <= 1 + Reassembly::kOfWriter; ++number) {
    received.take(fragment(1, number, 1, 200, 100));
  }
  CHECK(received.take(fragment(1, 1, 2, 200, 100)) == 0);  // that one was dropped
  CHECK(received.take(fragment(1, 5, 2, 200, 100)) == 1);
}

}  // namespace tfdude::fastdds
