#include "transport/fastdds/announcement.hpp"

#include "support/catch.hpp"

namespace tfdude::fastdds {
namespace {

std::vector<std::uint8_t> bytes(const std::string& text) { return {text.begin(), text.end()}; }

TEST_CASE("a participant announces its partition and its versions") {
  const Announcement arm = read_announcement(participant_name("arm"), user_data(""));
  CHECK(arm.partition == "arm");
  CHECK(arm.protocol == kProtocolVersion);
  CHECK(arm.program == program_version());
  CHECK(arm.compatible());
  const Announcement client = read_announcement(participant_name(""), user_data(""));
  CHECK(client.partition.empty());
  CHECK(client.compatible());
}

TEST_CASE("a participant with keys says whose") {
  const Announcement arm = read_announcement(participant_name("arm"), user_data("3fe2"));
  CHECK(arm.authority == "3fe2");
  CHECK(arm.program == program_version());
  CHECK(read_announcement(participant_name("arm"), user_data("")).authority.empty());
  CHECK(read_announcement("tfdude serving arm", bytes("tfdude-protocol 1 0 1 keys")).authority ==
        "");
}

TEST_CASE("only another major version is incompatible") {
  const auto said = [](const std::string& text) {
    return read_announcement("tfdude serving arm", bytes(text));
  };
  CHECK(said("tfdude-protocol 1 65535 9.9").compatible());
  CHECK_FALSE(said("tfdude-protocol 2 0 9.9").compatible());
  CHECK_FALSE(said("tfdude-protocol 0 9 0.0").compatible());
  CHECK(said("tfdude-protocol 2 3").protocol == ProtocolVersion{2, 3});
  CHECK(said("tfdude-protocol 2 3 4.5.6 and more").program == "4.5.6");
}

TEST_CASE("a participant of tf-dude without a version counts as incompatible") {
  for (const char* text : {"", "tfdude-protocol", "tfdude-protocol 1", "other 1 0",
                           "tfdude-protocol 70000 0", "tfdude-protocol x y"}) {
    CAPTURE(text);
    const Announcement said = read_announcement("tfdude serving arm", bytes(text));
    CHECK(said.partition == "arm");
    CHECK(said.protocol == ProtocolVersion{});
    CHECK_FALSE(said.compatible());
  }
}

TEST_CASE("other programs count as compatible whatever they announce") {
  const Announcement said = read_announcement("RTPSParticipant", bytes("\xff\x00 2 0"));
  CHECK(said.partition.empty());
  CHECK(said.compatible());
}

}  // namespace
}  // namespace tfdude::fastdds
