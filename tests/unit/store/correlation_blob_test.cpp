#include "store/correlation_blob.hpp"

#include <cmath>
#include <string>

#include "support/catch.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::Random;

Correlation any_correlation(Random& random) {
  const auto loading = [&](Eigen::Index columns) -> Loading {
    return Loading::NullaryExpr(6, columns, [&](auto, auto) { return random.normal(); });
  };
  return {
      true,
      {{"calibration", false, loading(1)}, {"observed:1.2.3", true, loading(kMaxLoadingColumns)}},
      {"hand", std::string(255, 'o')}};
}

TEST_CASE("a correlation is stored and restored to the last bit") {
  Random random(0x7135);
  INFO("seed " << random.seed());
  for (int i = 0; i < 50; ++i) {
    const Correlation correlation = any_correlation(random);
    const auto back = correlation_from(to_blob(correlation));
    REQUIRE(back);
    CHECK(*back == correlation);
  }
  const auto none = correlation_from(to_blob({}));
  REQUIRE(none);
  CHECK(none->empty());
}

TEST_CASE("a stored correlation that is truncated or too long is rejected") {
  Random random(0x7136);
  INFO("seed " << random.seed());
  const std::string whole = to_blob(any_correlation(random));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    INFO(size);
    CHECK_FALSE(correlation_from(whole.substr(0, size)));
  }
  CHECK_FALSE(correlation_from(whole + '\0'));
}

TEST_CASE("what observations have found is stored with the pose as it was given") {
  Random random(0x7138);
  INFO("seed " << random.seed());
  StoredCorrelation kept;
  CHECK(observed_blob(kept).empty());
  kept.observed = any_correlation(random);
  for (const auto& given : {std::optional<Pose>(), std::optional(random.pose())}) {
    kept.given = given;
    const std::string whole = observed_blob(kept);
    StoredCorrelation back;
    REQUIRE(read_observed(whole, back));
    CHECK(back == kept);
    for (std::size_t size = 0; size < whole.size(); ++size) {
      StoredCorrelation cut;
      const bool complete = given && size == to_blob(*kept.observed).size();
      CHECK(read_observed(whole.substr(0, size), cut).has_value() == complete);
    }
    CHECK_FALSE(read_observed(whole + '\0', back));
  }
}

TEST_CASE("an invalid stored correlation is rejected") {
  Correlation bad;
  SECTION("a loading that is not a number") {
    bad.common_errors.push_back({"supply", false, Loading::Constant(6, 1, std::nan(""))});
  }
  SECTION("a source named twice") {
    bad.common_errors.assign(2, {"supply", false, Loading::Ones(6, 1)});
  }
  SECTION("an edge without a name") { bad.observed_with.emplace_back(); }
  CHECK_FALSE(correlation_from(to_blob(bad)));
}

TEST_CASE("reading a damaged correlation never crashes") {
  Random random(0x7137);
  INFO("seed " << random.seed());
  const std::string whole = to_blob(any_correlation(random));
  for (int i = 0; i < 2000; ++i) {
    std::string bytes = whole;
    bytes[random.index(bytes.size())] = static_cast<char>(random.index(256));
    if (const auto read = correlation_from(bytes)) CHECK(to_blob(*read) == bytes);
  }
}

}  // namespace
}  // namespace tfdude
