// Numbers in texts, whatever the locale of the program is (this one's is German).

#include <algorithm>
#include <clocale>
#include <locale>
#include <sstream>
#include <string>

#include "tfdude/base/number.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/math/pose.hpp"

#include "support/catch.hpp"
#include "transport/fastdds/addresses.hpp"
#include "transport/fastdds/announcement.hpp"
#include "transport/fastdds/identity.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::ContainsSubstring;

// Separates thousands as in a locale that Fast DDS, which reads with the global one, may meet.
struct Grouping final : std::numpunct<char> {
  explicit Grouping(char with) : separator(with) {}
  [[nodiscard]] char do_thousands_sep() const override { return separator; }
  [[nodiscard]] std::string do_grouping() const override { return "\3"; }
  const char separator;
};

}  // namespace

TEST_CASE("locale: this program writes a comma before decimals") {
  std::ostringstream text;
  text << 1234567.5;
  CHECK(text.str() == "1,23457e+06");
  CHECK(std::to_string(0.5).substr(0, 3) == "0,5");
}

TEST_CASE("locale: texts of numbers have a point, and nothing between thousands") {
  CHECK(number_text(-1.5) == "-1.5");
  CHECK(number_text(123456) == "123456");
  CHECK(number_text(1234567.25, 12) == "1234567.25");
  CHECK(number_text(1e9) == "1e+09");
  CHECK(fixed_text(-0.25, 3) == "-0.250");
  CHECK(fixed_text(1e300, 3).size() == 305);
  CHECK(fixed_text(1.0 / 3, 1000).size() == 42);
  CHECK(in_milliseconds(1'234'567'800us) == "1234567.800 ms");
  CHECK(to_string(Time(1'700'000'000'123ms)) == "2023-11-14 22:13:20.123 UTC");
  const auto pose = Pose::create(Eigen::Quaterniond(0.5, 0, 0, 0), {});
  REQUIRE_FALSE(pose);
  CHECK_THAT(pose.error().message, ContainsSubstring("norm 0.5,"));
}

TEST_CASE("locale: Fast DDS reads the identity of a writer in any locale") {
  for (const char separator : {'.', ',', ' ', '\''}) {
    CAPTURE(separator);
    fastdds::edds::DataWriterQos qos;
    fastdds::be_a_writer_of_its_own(qos);
    const auto& all = qos.properties().properties();
    const auto own = std::find_if(all.begin(), all.end(), [](const auto& property) {
      return property.name() == "dds.persistence.guid";
    });
    REQUIRE(own != all.end());
    std::istringstream text(own->value());
    text.imbue(std::locale(std::locale::classic(), new Grouping(separator)));
    fastdds::ertps::GUID_t guid;
    text >> guid;
    CHECK(guid != fastdds::ertps::GUID_t::unknown());
    CHECK(guid.entityId.value[3] == 1);
    CHECK(guid.guidPrefix.value[1] == fastdds::etransport::c_VendorId_eProsima[1]);
  }
}

TEST_CASE("locale: the addresses of a host and of the group are not read as text") {
  fastdds::ertps::Locator_t any;
  any.port = 7400;
  fastdds::ertps::LocatorList_t list;
  list.push_back(any);
  fastdds::name_group(list);
  CHECK(fastdds::ertps::IPLocator::toIPv4string(*list.begin()) == "239.255.0.1");
  const auto none = fastdds::named(any, [](const auto&) { return false; });
  REQUIRE(none.size() == 1);
  CHECK(fastdds::ertps::IPLocator::toIPv4string(*none.begin()) == "127.0.0.1");
  CHECK(none.begin()->port == 7400);
}

TEST_CASE("locale: the version of another participant is read") {
  const auto said =
      fastdds::read_announcement(fastdds::participant_name("arm"), fastdds::user_data("0123"));
  CHECK(said.compatible());
  CHECK(said.authority == "0123");
}

}  // namespace tfdude
