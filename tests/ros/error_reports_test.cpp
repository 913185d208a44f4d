#include "tfdude-ros/logic/error_reports.hpp"

#include <string>

#include "support/catch.hpp"

namespace tfdude::ros {
namespace {

Error no_data(Errc code, const std::string& frame, int seconds) {
  return {code, "no data for " + std::to_string(seconds) + " s", frame, "arm"};
}

TEST_CASE("ros errors: each is told once, and again after a success") {
  ErrorReports reports;
  const Error one{Errc::kUnknownFrame, "no frame 'a'"};
  const Error other{Errc::kUnknownFrame, "no frame 'b'"};
  CHECK(reports.is_new(one));
  CHECK(reports.is_new(other));
  CHECK_FALSE(reports.is_new(one));
  CHECK_FALSE(reports.is_new(other));
  reports.succeeded();
  CHECK(reports.is_new(one));
}

TEST_CASE("ros errors: missing data is told once for each edge, whatever the instants") {
  ErrorReports reports;
  CHECK(reports.is_new(no_data(Errc::kNotYet, "odom", 1)));
  CHECK_FALSE(reports.is_new(no_data(Errc::kNotYet, "odom", 2)));
  CHECK(reports.is_new(no_data(Errc::kTooOld, "odom", 3)));
  CHECK(reports.is_new(no_data(Errc::kNotYet, "base", 3)));
  reports.succeeded();
  CHECK_FALSE(reports.is_new(no_data(Errc::kNotYet, "odom", 4)));
}

TEST_CASE("ros errors: what is remembered is bounded") {
  ErrorReports reports;
  int told = 0;
  for (int i = 0; i < 3000; ++i) {
    if (reports.is_new({Errc::kInvalidInput, std::to_string(i)})) ++told;
  }
  CHECK(told == 1000);
}

}  // namespace
}  // namespace tfdude::ros
