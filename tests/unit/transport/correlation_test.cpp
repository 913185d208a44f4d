// Bounds of correlations in messages. A message beyond them is rejected before it is deserialized,
// or when it is read.

#include <limits>

#include "support/catch.hpp"
#include "support/samples.hpp"
#include "transport/fastdds/field_values.hpp"

namespace tfdude::fastdds {
namespace {

using testing::ContainsSubstring;
using testing::Random;
using testing::serialized;

bool well_formed(const wire::State& sample) {
  const auto bytes = serialized<StateType>(sample);
  return well_formed_state(bytes.data(), bytes.size());
}

wire::State state_of(const wire::Correlation& correlation, std::size_t count = 1) {
  wire::State state;
  state.entries().resize(1);
  state.entries()[0].x(Numbers(28));
  state.entries()[0].x()[3] = 1.0;
  state.correlations().resize(count);
  for (auto& one : state.correlations()) one.edge_correlation(correlation);
  return state;
}

wire::CommonError common_error(std::size_t numbers, const std::string& source = "s") {
  wire::CommonError common_error;
  common_error.loading().assign(numbers, 0.5);
  common_error.source(source);
  return common_error;
}

TEST_CASE("correlation: a sequence above its bound is not well-formed") {
  wire::Correlation correlation;
  CHECK(well_formed(state_of(correlation)));
  CHECK(well_formed(state_of(correlation, kMaxCorrelated)));
  CHECK_FALSE(well_formed(state_of(correlation, kMaxCorrelated + 1)));
  correlation.common_errors().assign(kMaxCorrelated, common_error(6));
  CHECK(well_formed(state_of(correlation)));
  correlation.common_errors().assign(kMaxCorrelated + 1, common_error(6));
  CHECK_FALSE(well_formed(state_of(correlation)));
  correlation.common_errors().assign(1, common_error(216));
  CHECK(well_formed(state_of(correlation)));
  correlation.common_errors().assign(1, common_error(217));
  CHECK_FALSE(well_formed(state_of(correlation)));
  correlation.common_errors().clear();
  correlation.observed_with().assign(kMaxCorrelated, "arm");
  CHECK(well_formed(state_of(correlation)));
  correlation.observed_with().assign(kMaxCorrelated + 1, "arm");
  CHECK_FALSE(well_formed(state_of(correlation)));
  correlation.observed_with().clear();
  correlation.unknown_part().assign(21, 1.0);
  CHECK(well_formed(state_of(correlation)));
  correlation.unknown_part().assign(22, 1.0);
  CHECK_FALSE(well_formed(state_of(correlation)));
}

TEST_CASE("correlation: an invalid correlation is rejected when it is read") {
  const auto refusal = [](const wire::Correlation& correlation) {
    const auto read = from_wire(state_of(correlation));
    REQUIRE_FALSE(read);
    CHECK(read.error().code == Errc::kInvalidInput);
    return read.error().message;
  };
  wire::Correlation correlation;
  correlation.common_errors().assign(1, common_error(7));
  CHECK_THAT(refusal(correlation), ContainsSubstring("7 numbers"));
  correlation.common_errors().assign(1, common_error(0));
  CHECK_THAT(refusal(correlation), ContainsSubstring("'s'"));
  correlation.common_errors().assign(2, common_error(6));
  CHECK_THAT(refusal(correlation), ContainsSubstring("twice"));
  correlation.common_errors().assign(1, common_error(6, ""));
  CHECK_THAT(refusal(correlation), ContainsSubstring("source"));
  correlation.common_errors().assign(1, common_error(6));
  correlation.common_errors()[0].loading()[3] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THAT(refusal(correlation), ContainsSubstring("not a number"));
  correlation.common_errors().clear();
  correlation.unknown_part().assign(20, 1.0);
  CHECK_THAT(refusal(correlation), ContainsSubstring("20 numbers"));
  correlation.unknown_part().assign(21, std::numeric_limits<double>::infinity());
  CHECK_THAT(refusal(correlation), ContainsSubstring("covariance"));
  auto astray = state_of({});
  astray.correlations()[0].entry(1);
  const auto read = from_wire(astray);
  REQUIRE_FALSE(read);
  CHECK_THAT(read.error().message, ContainsSubstring("entry 1"));
}

TEST_CASE("correlation: an invalid order of a lookup or an invalid revision is rejected") {
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
