#include "runtime/open_groups.hpp"

#include "support/catch.hpp"

using namespace std::chrono_literals;
using tfdude::OpenGroups;

namespace {

const OpenGroups::Clock::time_point kStart{};

}  // namespace

TEST_CASE("open groups: a group that is used stays open") {
  OpenGroups open;
  open.insert(1, kStart);
  CHECK(open.take_unused({1}, kStart + 1h).empty());
  CHECK(open.contains(1));
}

TEST_CASE("open groups: an unused group stays open for a while") {
  OpenGroups open;
  open.insert(1, kStart);
  CHECK(open.take_unused({1}, kStart + 1h).empty());
  CHECK(open.take_unused({}, kStart + 1h + OpenGroups::kKept - 1ms).empty());
  REQUIRE(open.contains(1));
  CHECK(open.take_unused({}, kStart + 1h + OpenGroups::kKept) == std::vector<std::uint64_t>{1});
  CHECK_FALSE(open.contains(1));
  CHECK(open.take_unused({}, kStart + 2h).empty());
}

TEST_CASE("open groups: too many unused groups are closed starting with the longest unused") {
  OpenGroups open;
  const std::uint64_t count = OpenGroups::kMostUnused + 2;
  for (std::uint64_t group = 0; group < count; ++group) {
    open.insert(group, kStart + group * 1ms);
  }
  open.insert(99, kStart);
  CHECK(open.take_unused({99}, kStart + 1s) == std::vector<std::uint64_t>{1, 0});
  CHECK(open.contains(99));
  CHECK(open.contains(2));
}
