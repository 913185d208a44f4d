#include "math/instant_sources.hpp"

#include <chrono>
#include <string>

#include "support/catch.hpp"

namespace tfdude {
namespace {

using testing::Approx;

CommonError error(const std::string& source, double by) {
  Loading F = Loading::Zero(6, 1);
  F(0, 0) = by;
  return {source, false, F};
}

Time at(int nanoseconds) { return Time(std::chrono::nanoseconds(nanoseconds)); }

double variance(std::vector<CommonError> errors) {
  return collapse({{}, {}, std::nullopt, std::move(errors)}).covariance.of_specified().upper()[0];
}

TEST_CASE("The error of a source at an instant has a name that tells the source") {
  const std::string now = instant_source("joint a=b@c", at(7));
  CHECK(said_source(now) == "joint a=b@c");
  CHECK(is_of_one_instant(now));
  CHECK(is_observed(error(now, 1)));
  CHECK(now != instant_source("joint a=b@c", at(8)));
  const std::string merged = merged_source("observed:1.2.3", "joint a=b@c");
  CHECK(said_source(merged) == "joint a=b@c");
  CHECK_FALSE(is_of_one_instant(merged));
  CHECK(said_source(as_merged(now)) == "joint a=b@c");
  CHECK_FALSE(is_of_one_instant(as_merged(now)));
  for (const char* other : {"joint a", "observed:1.2.3", "observed:@1.2.3", "a=b", ""}) {
    CHECK(said_source(other).empty());
  }
}

TEST_CASE("A source's errors between samples have the name of both stamps") {
  const std::string name = source_between("joint a=b@c", at(3), at(7));
  CHECK(said_source(name) == "joint a=b@c");
  CHECK(is_between_samples(name));
  CHECK_FALSE(is_of_one_instant(name));
  CHECK_FALSE(is_between_samples(instant_source("joint a=b@c", at(7))));
  CHECK_FALSE(is_between_samples("joint a"));
  CHECK(name != source_between("joint a=b@c", at(3), at(8)));
}

TEST_CASE("Long names of sources are told apart") {
  std::string one;
  for (int i = 0; i < 127; ++i) one += "ü";
  const std::string other = one.substr(0, one.size() - 2) + "ä";
  const std::string name = instant_source(one, Time::max());
  CHECK(check_common_errors({error(name, 1), error(instant_source(other, Time::max()), 1)}));
  CHECK(check_common_errors({error(
      merged_source("observed:1764294934000000000.1234567.99999.9+3", said_source(name)), 1)}));
  CHECK(is_source_itself(one, said_source(name)));
  CHECK_FALSE(is_source_itself(other, said_source(name)));
  CHECK(instant_source(said_source(name), Time::max()) == name);
}

TEST_CASE("At its instant the error of a source is the source's") {
  std::vector<CommonError> errors = {error("a", 3), error(instant_source("a", at(7)), -2),
                                     error(instant_source("b", at(7)), 5)};
  std::vector<CommonError> later = errors;
  CHECK_FALSE(join_instant(later, at(8)));
  CHECK(later == errors);
  CHECK(join_instant(errors, at(7)));
  CHECK(errors == std::vector<CommonError>{error("a", 1), error(instant_source("b", at(7)), 5)});
}

TEST_CASE("A source and its error at some instants may be correlated in any way") {
  const std::string then = instant_source("a", at(7));
  const std::string before = merged_source("observed:1", "a");
  CHECK(variance({error("a", 3), error(then, 3)}) == Approx(36));
  CHECK(variance({error("a", 3), error(then, 1)}) == Approx(16));
  CHECK(variance({error("b", 3), error(then, 1)}) == Approx(10));
  CHECK(variance({error("a", 0), error(then, 1)}) == Approx(1));
  CHECK(variance({error(before, 3), error(then, 4)}) == Approx(25));
  CHECK(variance({error("a", 5), error(before, 3), error(then, 4)}) == Approx(100));
  // Each two samples are a side of their own.
  const std::string here = source_between("a", at(3), at(7));
  const std::string beside = source_between("a", at(5), at(8));
  CHECK(variance({error(here, 3), error(beside, 4)}) == Approx(49));
  CHECK(variance({error("a", 5), error(here, 3), error(beside, -4)}) == Approx(144));
  CHECK(variance({error("b", 5), error(here, 3)}) == Approx(34));
  CHECK(variance({error("a", 0), error(here, 3), error(then, 4)}) == Approx(49));
  const std::vector<OfSource> parts = {
      {"a", Covariance::trusted(Matrix6d(Matrix6d::Identity()))},
      {"b", Covariance::trusted(Matrix6d(Matrix6d::Identity()))},
      {then, Covariance::trusted(Matrix6d(4 * Matrix6d::Identity()))}};
  bool bounded = false;
  CHECK(sum_of_sources(parts, bounded).upper()[0] == Approx(10));
  CHECK(bounded);
}

}  // namespace
}  // namespace tfdude
