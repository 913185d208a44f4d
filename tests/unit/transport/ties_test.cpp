// Bounds of what is told of correlation: what exceeds them is refused before it is deserialized, or read.

#include <limits>

#include "support/catch.hpp"
#include "support/samples.hpp"

namespace tfdude::fastdds {
namespace {

using testing::ContainsSubstring;
using testing::Random;
using testing::serialized;

bool well_formed(const wire::State& sample) {
  const auto bytes = serialized<StateType>(sample);
  return well_formed_state(bytes.data(), bytes.size());
}

wire::State state_of(const wire::Correlation& ties, std::size_t count = 1) {
  wire::State state;
  state.entries().resize(1);
  state.entries()[0].x()[3] = 1.0;
  state.ties().resize(count);
  for (auto& one : state.ties()) one.ties(ties);
  return state;
}

wire::Share share(std::size_t numbers, const std::string& source = "s") {
  wire::Share share;
  share.factor().assign(numbers, 0.5);
  share.source(source);
  return share;
}

TEST_CASE("ties: what is longer than its bound is not well formed") {
  wire::Correlation ties;
  CHECK(well_formed(state_of(ties)));
  CHECK(well_formed(state_of(ties, kMaxTies)));
  CHECK_FALSE(well_formed(state_of(ties, kMaxTies + 1)));
  ties.shares().assign(kMaxTies, share(6));
  CHECK(well_formed(state_of(ties)));
  ties.shares().assign(kMaxTies + 1, share(6));
  CHECK_FALSE(well_formed(state_of(ties)));
  ties.shares().assign(1, share(216));
  CHECK(well_formed(state_of(ties)));
  ties.shares().assign(1, share(217));
  CHECK_FALSE(well_formed(state_of(ties)));
  ties.shares().clear();
  ties.observed_with().assign(kMaxTies, "arm");
  CHECK(well_formed(state_of(ties)));
  ties.observed_with().assign(kMaxTies + 1, "arm");
  CHECK_FALSE(well_formed(state_of(ties)));
  ties.observed_with().clear();
  ties.unknown_part().assign(21, 1.0);
  CHECK(well_formed(state_of(ties)));
  ties.unknown_part().assign(22, 1.0);
  CHECK_FALSE(well_formed(state_of(ties)));
}

TEST_CASE("ties: what cannot be meant is refused when it is read") {
  const auto refusal = [](const wire::Correlation& ties) {
    const auto read = from_wire(state_of(ties));
    REQUIRE_FALSE(read);
    CHECK(read.error().code == Errc::kInvalidInput);
    return read.error().message;
  };
  wire::Correlation ties;
  ties.shares().assign(1, share(7));
  CHECK_THAT(refusal(ties), ContainsSubstring("7 numbers"));
  ties.shares().assign(1, share(0));
  CHECK_THAT(refusal(ties), ContainsSubstring("'s'"));
  ties.shares().assign(2, share(6));
  CHECK_THAT(refusal(ties), ContainsSubstring("twice"));
  ties.shares().assign(1, share(6, ""));
  CHECK_THAT(refusal(ties), ContainsSubstring("source"));
  ties.shares().assign(1, share(6));
  ties.shares()[0].factor()[3] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THAT(refusal(ties), ContainsSubstring("not a number"));
  ties.shares().clear();
  ties.unknown_part().assign(20, 1.0);
  CHECK_THAT(refusal(ties), ContainsSubstring("20 numbers"));
  ties.unknown_part().assign(21, std::numeric_limits<double>::infinity());
  CHECK_THAT(refusal(ties), ContainsSubstring("covariance"));
  auto astray = state_of({});
  astray.ties()[0].entry(1);
  const auto read = from_wire(astray);
  REQUIRE_FALSE(read);
  CHECK_THAT(read.error().message, ContainsSubstring("entry 1"));
}

TEST_CASE(
    "ties: a lookup of another order than 2 or 4, and an observation of nothing, are refused") {
  Random random(0x71e5);
  auto lookup = to_wire(Request{1, "hand", LookupRequest{{{"a", "b"}}, {}, time_of(5)}}, "arm");
  REQUIRE(from_wire(lookup));
  for (const unsigned order : {0U, 1U, 3U, 5U, 255U}) {
    lookup.body().lookup_at().order(static_cast<std::uint8_t>(order));
    const auto refused = from_wire(lookup);
    REQUIRE_FALSE(refused);
    CHECK_THAT(refused.error().message, ContainsSubstring("order"));
  }
  CHECK_FALSE(from_wire(to_wire(Request{1, "hand", ReviseRequest{}}, "arm")));
  ReviseRequest bad{{{"hand", {0, 1, 2}, false, {}}}, {}, 0};
  bad.edges[0].innovation.squares = std::numeric_limits<double>::quiet_NaN();
  const auto refused = from_wire(to_wire(Request{1, "hand", bad}, "arm"));
  REQUIRE_FALSE(refused);
  CHECK_THAT(refused.error().message, ContainsSubstring("'hand'"));
}

}  // namespace
}  // namespace tfdude::fastdds
