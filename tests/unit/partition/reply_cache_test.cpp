#include "tfdude/partition/reply_cache.hpp"

#include <limits>
#include <string>

#include "support/catch.hpp"

namespace tfdude {
namespace {

constexpr auto kPerPeer = static_cast<std::uint32_t>(ReplyCache::kPerPeer);

PeerId peer(std::size_t number) {
  PeerId id{};
  id[0] = static_cast<std::uint8_t>(number);
  id[11] = static_cast<std::uint8_t>(number >> 8U);
  return id;
}

// Replies are told apart by their epoch.
Reply reply(std::uint32_t sequence, std::uint64_t epoch) { return {sequence, epoch, Done{}}; }

TEST_CASE("a request that was never answered is new") {
  ReplyCache cache;
  CHECK_FALSE(cache.find(peer(1), 1));
  cache.put(peer(1), reply(1, 10));
  CHECK_FALSE(cache.find(peer(1), 2));
  CHECK_FALSE(cache.find(peer(2), 1));
}

TEST_CASE("a repeated request finds its reply as often as it is asked") {
  ReplyCache cache;
  cache.put(peer(1), reply(1, 10));
  cache.put(peer(1), reply(2, 20));
  cache.put(peer(2), {1, 30, Error{Errc::kCycle, "no"}});
  for (int repetition = 0; repetition < 3; ++repetition) {
    CHECK(cache.find(peer(1), 1)->epoch == 10);
    CHECK(cache.find(peer(1), 2)->epoch == 20);
    const auto refused = cache.find(peer(2), 1);
    REQUIRE(refused);
    CHECK(refused->epoch == 30);
    CHECK(std::get<Error>(refused->body).message == "no");
  }
}

TEST_CASE("the last 256 replies to a peer are kept, older requests are refused") {
  ReplyCache cache;
  for (std::uint32_t i = 1; i <= kPerPeer; ++i) cache.put(peer(1), reply(i, i));
  CHECK(cache.find(peer(1), 1)->epoch == 1);
  cache.put(peer(1), reply(kPerPeer + 1, kPerPeer + 1));
  const auto too_old = cache.find(peer(1), 1);
  REQUIRE(too_old);
  CHECK(too_old->sequence == 1);
  const Error& error = std::get<Error>(too_old->body);
  CHECK(error.code == Errc::kInvalidInput);
  CHECK(error.message == "request 1 is too old: the same peer has sent 257 since");
  CHECK(cache.find(peer(1), 2)->epoch == 2);
  CHECK(cache.find(peer(1), kPerPeer + 1)->epoch == kPerPeer + 1);
}

TEST_CASE("the counter of requests may wrap round") {
  constexpr std::uint32_t kLast = std::numeric_limits<std::uint32_t>::max();
  ReplyCache cache;
  cache.put(peer(1), reply(kLast - 5, 1));
  const std::uint32_t after = kLast - 5 + kPerPeer;  // beyond zero, in the same place
  CHECK(after < kPerPeer);
  CHECK_FALSE(cache.find(peer(1), after));
  cache.put(peer(1), reply(after, 2));
  CHECK(cache.find(peer(1), after)->epoch == 2);
  CHECK(std::holds_alternative<Error>(cache.find(peer(1), kLast - 5)->body));
}

TEST_CASE("of 257 peers the one that asked longest ago is forgotten") {
  ReplyCache cache;
  for (std::size_t i = 0; i < ReplyCache::kPeers; ++i) cache.put(peer(i), reply(1, i));
  SECTION("asking again, answered or not, is what counts") {
    CHECK(cache.find(peer(0), 1)->epoch == 0);
    CHECK_FALSE(cache.find(peer(1), 2));
    cache.put(peer(1000), reply(1, 1000));
    CHECK_FALSE(cache.find(peer(2), 1));
    CHECK(cache.find(peer(0), 1));
    CHECK(cache.find(peer(1), 1));
  }
  SECTION("a peer that is new makes room by its first request") {
    CHECK_FALSE(cache.find(peer(1000), 1));
    CHECK(cache.find(peer(1), 1));
    CHECK(cache.find(peer(255), 1));
    CHECK_FALSE(cache.find(peer(0), 1));
  }
}

}  // namespace
}  // namespace tfdude
