#include "tfdude/base/result.hpp"

#include <set>
#include <string>

#include "support/catch.hpp"

namespace tfdude {
namespace {

struct Named {
  Errc code;
  int number;
  std::string_view name;
};

// Both the numbers (wire) and the names (JSON) are promises to others.
constexpr Named kCodes[] = {
    {Errc::kInvalidInput, 1, "invalid_input"},
    {Errc::kUnknownFrame, 2, "unknown_frame"},
    {Errc::kUnknownStart, 3, "unknown_start"},
    {Errc::kUnknownEnd, 4, "unknown_end"},
    {Errc::kUnknownParent, 5, "unknown_parent"},
    {Errc::kUnknownPartition, 6, "unknown_partition"},
    {Errc::kAlreadyExists, 7, "already_exists"},
    {Errc::kNotConnected, 8, "not_connected"},
    {Errc::kCycle, 9, "cycle"},
    {Errc::kNotOwner, 10, "not_owner"},
    {Errc::kPartitionTaken, 11, "partition_taken"},
    {Errc::kUnreachable, 12, "unreachable"},
    {Errc::kTimeout, 13, "timeout"},
    {Errc::kConfig, 14, "config"},
    {Errc::kTransport, 15, "transport"},
    {Errc::kState, 16, "state"},
    {Errc::kNotYet, 17, "not_yet"},
    {Errc::kTooOld, 18, "too_old"},
    {Errc::kStampTaken, 19, "stamp_taken"},
    {Errc::kChangedMeanwhile, 20, "changed_meanwhile"},
    {Errc::kUnknownJoint, 21, "unknown_joint"},
    {Errc::kIncompatible, 22, "incompatible"},
    {Errc::kUnsupported, 23, "unsupported"},
    {Errc::kNotPermitted, 24, "not_permitted"},
    {Errc::kTooMuch, 25, "too_much"},
    {Errc::kAmbiguousJoint, 26, "ambiguous_joint"},
};

TEST_CASE("codes keep their numbers and names") {
  for (const Named& expected : kCodes) {
    CAPTURE(expected.number);
    CHECK(static_cast<int>(expected.code) == expected.number);
    CHECK(to_string(expected.code) == expected.name);
  }
}

TEST_CASE("the names of all codes are distinct") {
  std::set<std::string_view> names;
  int known = 0;
  // All 256 values, so that a code added without a name, or to this table, is noticed.
  for (int number = 0; number < 256; ++number) {
    const std::string_view name = to_string(static_cast<Errc>(number));
    if (name == "unknown") continue;
    names.insert(name);
    ++known;
  }
  CHECK(known == static_cast<int>(std::size(kCodes)));
  CHECK(static_cast<int>(names.size()) == known);
}

TEST_CASE("codes that say that something does not exist have names that begin with unknown") {
  for (const Named& one : kCodes) {
    CAPTURE(one.name);
    CHECK(is_unknown(one.code) == (one.name.substr(0, 8) == "unknown_"));
  }
}

TEST_CASE("fail carries the code and the message") {
  const Result<int> result = fail(Errc::kCycle, "arm is below hand");
  REQUIRE_FALSE(result);
  CHECK(result.error().code == Errc::kCycle);
  CHECK(result.error().message == "arm is below hand");
}

TEST_CASE("fail_at prepends the place and keeps the code") {
  const Result<int> result = fail_at("frame 'arm'", Error{Errc::kTimeout, "no answer"});
  REQUIRE_FALSE(result);
  CHECK(result.error().code == Errc::kTimeout);
  CHECK(result.error().message == "frame 'arm': no answer");
}

TEST_CASE("an error keeps what it is about where a place is put before it") {
  const Error error{Errc::kNotYet, "no data", "hand", "arm", Interval{Time{}, time_of(5)}};
  const Result<int> result = fail_at("lookup 3", error);
  REQUIRE_FALSE(result);
  CHECK(result.error().message == "lookup 3: no data");
  CHECK(result.error().frame == "hand");
  CHECK(result.error().partition == "arm");
  CHECK(result.error().available == error.available);
}

TEST_CASE("an error that came as a text names the first frame and partition of it") {
  const auto named = [](const std::string& message) {
    const Error error = error_of_text(Errc::kTimeout, message);
    CHECK(error.message == message);
    return error.frame + "|" + error.partition;
  };
  CHECK(named("no frame 'hand' to end at") == "hand|");
  CHECK(named("frames 'a' and 'b' have no common root") == "a|");
  CHECK(named("the edge of 'x' has no data; frame 'y'") == "x|");
  CHECK(named("frame 'y' is below the edge of 'x'") == "y|");
  CHECK(named("partition 'arm' did not answer") == "|arm");
  CHECK(named("the subframe 'no' of partition 'p'") == "|p");
  CHECK(named("(frame 'f')") == "f|");
  CHECK(named("frame '' and partition 'p' without an end: partition 'q") == "|p");
  CHECK(named("frame 'without an end") == "|");
  CHECK(named("") == "|");
}

TEST_CASE("a value that is not there fails a test with the message of the error") {
  const Result<int> result = fail(Errc::kTimeout, "no answer from partition 'arm'");
  CHECK_THROWS_WITH(result.value(), "no answer from partition 'arm'");
}

}  // namespace
}  // namespace tfdude
