// Messages that earlier versions of the same major number have sent (tests/recorded).

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "support/catch.hpp"
#include "support/samples.hpp"

namespace tfdude::fastdds {
namespace {

template <class Type, class Sample>
void check_recorded(const std::filesystem::path& folder) {
  if (!std::filesystem::exists(folder)) return;  // that version has added no kind
  int count = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    INFO(file.path());
    std::ifstream in(file.path(), std::ios::binary);
    const testing::Bytes recorded{std::istreambuf_iterator<char>(in), {}};
    Sample sample;
    REQUIRE(testing::deserialized<Type>(recorded, sample));
    CHECK(testing::take<Type, Sample>(recorded));
    const testing::Bytes again = testing::serialized<Type>(sample);
    REQUIRE(again.size() >= recorded.size());
    CHECK(std::equal(recorded.begin(), recorded.end(), again.begin()));
    ++count;
  }
  CHECK(count > 0);
}

TEST_CASE("recorded messages are read and written again with the same bytes") {
  int versions = 0;
  for (const auto& version : std::filesystem::directory_iterator(TFDUDE_RECORDED)) {
    if (!version.is_directory()) continue;
    const std::filesystem::path& folder = version.path();
    check_recorded<RequestType, wire::Request>(folder / "request");
    check_recorded<ReplyType, wire::Reply>(folder / "reply");
    check_recorded<UpdateType, wire::Update>(folder / "update");
    check_recorded<JointsType, wire::Joints>(folder / "joint");
    check_recorded<StateType, wire::State>(folder / "state");
    check_recorded<ClockType, wire::Clock>(folder / "clock");
    check_recorded<PageType, wire::Page>(folder / "page");
    check_recorded<PresenceType, wire::Presence>(folder / "presence");
    ++versions;
  }
  CHECK(versions > 0);
}

}  // namespace
}  // namespace tfdude::fastdds
