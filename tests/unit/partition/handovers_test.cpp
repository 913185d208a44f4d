// The parts of what is known of frames that are handed over.

#include "partition/handovers.hpp"

#include <string>

#include "support/catch.hpp"
#include "support/forest_support.hpp"

namespace tfdude {
namespace {

using testing::outcome;

PeerId peer(std::uint8_t number) { return {number}; }

Time at(std::int64_t seconds) { return time_of(seconds * 1'000'000'000); }

HandedEdge edge(const std::string& id, std::int64_t first, std::int64_t count, bool continues) {
  HandedEdge edge;
  edge.id = id;
  for (std::int64_t i = first; i < first + count; ++i) edge.samples.push_back({time_of(i), {}});
  edge.continues = continues;
  return edge;
}

HandedPart part(std::uint32_t first, std::vector<HandedEdge> edges, bool begins = false,
                bool is_last = false) {
  return {7, first, begins, is_last, std::move(edges)};
}

}  // namespace

TEST_CASE("the parts of a handover are put together") {
  AdoptedParts parts;
  const auto one = parts.add(peer(1), "a", part(0, {edge("a", 0, 2, true)}, true), at(0));
  REQUIRE(one);
  CHECK_FALSE(one->has_value());
  REQUIRE(parts.add(peer(1), "a", part(0, {edge("a", 2, 3, true)}), at(1)));
  REQUIRE(parts.add(peer(2), "x", part(0, {edge("x", 0, 0, false)}, true), at(1)));
  REQUIRE(parts.add(peer(1), "a", part(0, {edge("a", 5, 1, false), edge("b", 0, 1, true)}), at(2)));
  const auto all = parts.add(
      peer(1), "a", part(1, {edge("b", 1, 1, false), edge("c", 0, 0, false)}, false, true), at(3));
  REQUIRE(all);
  REQUIRE(all->has_value());
  REQUIRE((*all)->size() == 3);
  CHECK((**all)[0].samples.size() == 6);
  CHECK((**all)[1].samples.size() == 2);
  for (const HandedEdge& one_edge : **all) CHECK_FALSE(one_edge.continues);
  // Over, so that no other part fits.
  CHECK_FALSE(parts.add(peer(1), "a", part(3, {edge("d", 0, 0, false)}, false, true), at(3)));
}

TEST_CASE("a part that does not fit ends a handover") {
  const auto fails = [](const std::string& top, const HandedPart& wrong, Time when = at(1)) {
    AdoptedParts parts;
    REQUIRE(parts.add(peer(1), "a", part(0, {edge("a", 0, 2, true)}, true), at(0)));
    const auto done = parts.add(peer(1), top, wrong, when);
    // Nothing is left of it. A part of another handover is none of this one.
    CHECK(
        (top == "b") ==
        parts.add(peer(1), "a", part(0, {edge("a", 2, 1, false)}, false, true), when).has_value());
    return outcome(done);
  };
  CHECK(fails("a", part(1, {edge("b", 0, 0, false)})) == "changed_meanwhile");
  CHECK(fails("b", part(0, {edge("a", 2, 1, false)})) == "changed_meanwhile");
  CHECK(fails("a", part(0, {edge("b", 2, 1, false)})) == "changed_meanwhile");
  CHECK(fails("a", part(0, {})) == "changed_meanwhile");
  CHECK(fails("a", part(0, {edge("a", 2, 1, true)}, false, true)) == "changed_meanwhile");
  CHECK(fails("a", part(0, {edge("a", 2, 1, false)}, false, true), at(11)) == "changed_meanwhile");
  HandedPart restarted = part(0, {edge("a", 2, 1, false)}, false, true);
  restarted.incarnation = 8;
  CHECK(fails("a", restarted) == "changed_meanwhile");
  HandedPart of_later = part(0, {edge("a", 2, 1, false)}, false, true);
  of_later.edges[0].lamport_time = 8;  // it was kept, and is offered again
  CHECK(fails("a", of_later) == "changed_meanwhile");
  CHECK(fails("a", part(0, {edge("a", 2, kMostHandedSamples - 1, true)})) == "too_much");
}

TEST_CASE("handovers to one partition are limited, and those that are given up make room") {
  AdoptedParts parts;
  for (std::uint8_t i = 0; i < AdoptedParts::kMost; ++i) {
    REQUIRE(parts.add(peer(i), "a", part(0, {edge("a", 0, 1, true)}, true), at(i)));
    REQUIRE(parts.add(peer(i), "a", part(0, {edge("a", 0, 1, true)}, true), at(i)));  // again
  }
  const HandedPart whole = part(0, {edge("c", 0, 1, false)}, true, true);
  const auto refused = parts.add(peer(9), "c", whole, at(5));
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::kTooMuch);
  CHECK(parts.add(peer(9), "c", whole, at(11)));
}

TEST_CASE("one sender does not take all the room for handovers") {
  AdoptedParts parts;
  const auto begin = [&](std::uint8_t from, const std::string& top, std::int64_t when) {
    return parts.add(peer(from), top, part(0, {edge(top, 0, 1, true)}, true), at(when));
  };
  const auto ends = [&](std::uint8_t from, const std::string& top) {
    return parts.add(peer(from), top, part(0, {edge(top, 1, 1, false)}, false, true), at(5))
        .has_value();
  };
  for (const char* top : {"a", "b", "c", "d"}) REQUIRE(begin(1, top, top[0] == 'b' ? 0 : 1));
  CHECK(outcome(begin(1, "e", 2)) == "too_much");
  REQUIRE(begin(2, "x", 3));
  CHECK(outcome(begin(2, "y", 3)) == "too_much");
  CHECK_FALSE(ends(1, "b"));  // the one that was heard of least recently
  for (const char* top : {"a", "c", "d"}) CHECK(ends(1, top));
  CHECK(ends(2, "x"));
}

}  // namespace tfdude
