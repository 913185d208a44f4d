#include "partition/reply_cache.hpp"

#include <limits>
#include <string>

#include "support/catch.hpp"

namespace tfdude {
namespace {

constexpr auto kReplies = static_cast<std::uint32_t>(ReplyCache::kReplies);
constexpr auto kPeers = static_cast<std::uint32_t>(ReplyCache::kPeers);
const Time kNow = time_of(1'700'000'000'000'000'000);

PeerId peer(std::size_t number) {
  PeerId id{};
  id[0] = static_cast<std::uint8_t>(number);
  id[5] = static_cast<std::uint8_t>(number >> 16U);
  id[11] = static_cast<std::uint8_t>(number >> 8U);
  return id;
}

Request request(std::uint32_t sequence, std::uint64_t awaits_from) {
  return {sequence, "hand", RemoveRequest{}, awaits_from};
}

/// An owner that only counts what it applies. The epoch of a reply is this count.
class Owner {
 public:
  Reply answer(const PeerId& from, const Request& request, Time now = kNow) {
    if (auto before = cache_.find(from, request, now)) return *before;
    const Reply reply{request.sequence, ++applied_, Done{}};
    cache_.put(from, request, reply);
    return reply;
  }
  [[nodiscard]] std::uint64_t applied() const { return applied_; }

 private:
  ReplyCache cache_;
  std::uint64_t applied_ = 0;
};

std::string refusal(const Reply& reply) {
  const auto* error = std::get_if<Error>(&reply.body);
  return error == nullptr ? "" : std::string(to_string(error->code)) + ": " + error->message;
}

TEST_CASE("a repeated request finds its reply any number of times") {
  ReplyCache cache;
  CHECK_FALSE(cache.find(peer(1), request(1, 1), kNow));
  cache.put(peer(1), request(1, 1), {1, 10, Done{}});
  CHECK_FALSE(cache.find(peer(1), request(2, 1), kNow));
  cache.put(peer(1), request(2, 1), {2, 20, Done{}});
  CHECK_FALSE(cache.find(peer(2), request(1, 1), kNow));
  cache.put(peer(2), request(1, 1), {1, 30, Error{Errc::kCycle, "no"}});
  for (int repetition = 0; repetition < 3; ++repetition) {
    CHECK(cache.find(peer(1), request(1, 1), kNow)->epoch == 10);
    CHECK(cache.find(peer(1), request(2, 1), kNow)->epoch == 20);
    const auto refused = cache.find(peer(2), request(1, 1), kNow);
    REQUIRE(refused);
    CHECK(refused->epoch == 30);
    CHECK(std::get<Error>(refused->body).message == "no");
  }
}

TEST_CASE("a late request is applied once however many of its peer came before") {
  Owner owner;
  for (std::uint32_t i = 2; i <= 10'000; ++i) (void)owner.answer(peer(1), request(i, 1));
  CHECK(owner.applied() == 9'999);
  const Reply late = owner.answer(peer(1), request(1, 1));
  CHECK(refusal(late).empty());
  CHECK(owner.applied() == 10'000);
  CHECK(owner.answer(peer(1), request(1, 1)).epoch == late.epoch);
  CHECK(owner.answer(peer(1), request(2, 1)).epoch == 1);
  CHECK(owner.applied() == 10'000);
}

TEST_CASE("a request that its peer has closed is never applied") {
  Owner owner;
  (void)owner.answer(peer(1), request(1, 1));
  (void)owner.answer(peer(1), request(7, 5));
  CHECK(owner.applied() == 2);
  for (const std::uint32_t over : {1U, 4U}) {
    CHECK(
        refusal(owner.answer(peer(1), request(over, 1))) ==
        "timeout: request " + std::to_string(over) +
            " was rejected: it may have been applied already; requests of this client below 5 are "
            "closed");
  }
  CHECK(owner.applied() == 2);
  CHECK(refusal(owner.answer(peer(1), request(5, 1))).empty());
  CHECK(owner.applied() == 3);
}

TEST_CASE("the counter of requests may wrap around") {
  constexpr std::uint64_t kRound = std::uint64_t{1} << 32U;
  Owner owner;
  (void)owner.answer(peer(1), request(0xFFFFFFFF, kRound - 1));
  (void)owner.answer(peer(1), request(0, kRound - 1));
  (void)owner.answer(peer(1), request(1, kRound - 1));
  CHECK(owner.applied() == 3);
  CHECK(owner.answer(peer(1), request(0xFFFFFFFF, kRound - 1)).epoch == 1);
  CHECK(owner.answer(peer(1), request(0, kRound - 1)).epoch == 2);
  // In the meantime the peer has sent more than half a round of requests to others.
  (void)owner.answer(peer(1), request(0xF0000000, kRound + 0xF0000000));
  CHECK(owner.applied() == 4);
  CHECK_FALSE(refusal(owner.answer(peer(1), request(1, kRound - 1))).empty());
  (void)owner.answer(peer(1), request(7, std::numeric_limits<std::uint64_t>::max()));
  CHECK(owner.applied() == 4);
}

TEST_CASE("a request that may have been applied is rejected if too many replies are expected") {
  Owner owner;
  for (std::uint32_t i = 2; i <= kReplies + 1; ++i) (void)owner.answer(peer(1), request(i, 1));
  CHECK(owner.answer(peer(1), request(2, 1)).epoch == 1);
  (void)owner.answer(peer(2), request(1, 1));
  CHECK(owner.applied() == kReplies + 1);
  CHECK_FALSE(refusal(owner.answer(peer(1), request(2, 1))).empty());
  CHECK_FALSE(refusal(owner.answer(peer(1), request(1, 1))).empty());
  CHECK(owner.answer(peer(1), request(3, 1)).epoch == 2);
  CHECK(owner.applied() == kReplies + 1);
}

TEST_CASE("a peer that may still repeat a request is not forgotten") {
  Owner owner;
  for (std::uint32_t i = 0; i < kPeers; ++i) (void)owner.answer(peer(i), request(1, 1));
  const std::uint64_t before = owner.applied();
  CHECK(refusal(owner.answer(peer(kPeers), request(1, 1))) ==
        "timeout: request 1 was rejected: more than 65536 clients have sent changes recently");
  (void)owner.answer(peer(0), request(1, 1));
  CHECK(owner.applied() == before);
  SECTION("until it was silent for long enough") {
    const Time later = kNow + ReplyCache::kSilence;
    (void)owner.answer(peer(0), request(1, 1), later);
    CHECK(refusal(owner.answer(peer(kPeers), request(1, 1), later)).empty());
    CHECK(owner.applied() == before + 1);
    (void)owner.answer(peer(0), request(1, 1), later);
    CHECK(owner.applied() == before + 1);
  }
  SECTION("unless the clock was set back") {
    CHECK(refusal(owner.answer(peer(kPeers), request(1, 1), time_of(1))).empty());
  }
}

}  // namespace
}  // namespace tfdude
