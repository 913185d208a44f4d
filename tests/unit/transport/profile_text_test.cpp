#include "transport/fastdds/profile_text.hpp"

#include <string>

#include "support/catch.hpp"

namespace tfdude::fastdds {
namespace {

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

constexpr const char* kDescribed =
    "<transport_descriptors><transport_descriptor><transport_id>wire</transport_id>"
    "</transport_descriptor></transport_descriptors>";

std::string participant(const std::string& transport) {
  return "<participant profile_name=\"one\" is_default_profile=\"true\"><rtps><userTransports>"
         "<transport_id>" +
         transport + "</transport_id></userTransports></rtps></participant>";
}

}  // namespace

TEST_CASE("profile text: names of profiles and transports get the suffix wherever they are used") {
  const auto xml = with_own_names(
      std::string("<profiles>") + kDescribed + participant("wire") + "</profiles>", "@1");
  REQUIRE(xml);
  CHECK(has(*xml, "profile_name=\"one@1\""));
  CHECK_FALSE(has(*xml, ">wire<"));
  CHECK(xml->find("wire@1") != xml->rfind("wire@1"));
}

TEST_CASE("profile text: a transport that another file describes keeps its name") {
  const auto xml = with_own_names("<profiles>" + participant("theirs") + "</profiles>", "@1");
  REQUIRE(xml);
  CHECK(has(*xml, ">theirs<"));
}

TEST_CASE("profile text: settings for the whole process are removed") {
  const auto xml = with_own_names("<dds><log><use_default>false</use_default></log><profiles>" +
                                      participant("wire") +
                                      "</profiles><library_settings><intraprocess_delivery>OFF"
                                      "</intraprocess_delivery></library_settings></dds>",
                                  "@1");
  REQUIRE(xml);
  CHECK(has(*xml, "one@1"));
  CHECK_FALSE(has(*xml, "log"));
  CHECK_FALSE(has(*xml, "intraprocess"));
  CHECK_FALSE(has(*xml, "is_default_profile"));
}

TEST_CASE("profile text: text that is not XML or has no profiles is rejected") {
  for (const char* bad : {"", "<profiles>", "<dds></dds>", "plain text", "<dds><types/></dds>"}) {
    INFO(bad);
    const auto xml = with_own_names(bad, "@1");
    REQUIRE_FALSE(xml);
    CHECK(xml.error().code == Errc::kConfig);
  }
}

TEST_CASE("profile text: one profile alone, with the transports if it is that of a participant") {
  const std::string xml = std::string("<profiles>") + kDescribed + participant("wire") +
                          "<data_writer profile_name=\"two\"/><data_reader profile_name=\"three\"/>"
                          "</profiles>";
  const std::string one = only_profile(xml, "one");
  CHECK(has(one, "participant profile_name=\"one\""));
  CHECK(has(one, "transport_descriptor"));
  CHECK_FALSE(has(one, "two"));
  const std::string two = only_profile(xml, "two");
  CHECK(has(two, "data_writer profile_name=\"two\""));
  CHECK_FALSE(has(two, "transport_descriptor"));
  CHECK_FALSE(has(two, "one"));
  CHECK_FALSE(has(two, "three"));
}

}  // namespace tfdude::fastdds
