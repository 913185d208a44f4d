#include "transport/fastdds/admission.hpp"

#include <vector>

#include "base/mutex.hpp"
#include "support/catch.hpp"

namespace tfdude::fastdds {
namespace {

using testing::ContainsSubstring;

constexpr PeerId kPeer{1};

Announcement owner_of(const std::string& partition, const std::string& authority) {
  Announcement said;
  said.is_ours = true;
  said.partition = partition;
  said.authority = authority;
  return said;
}

struct Door {
  explicit Door(const std::string& authority) { admission.configure(authority); }

  int met = 0;
  Admission admission{[this](const PeerId&, const Announcement&) { ++met; }};
};

TEST_CASE("admission: without keys, all that have none are met at once") {
  Door door("");
  door.admission.discovered(kPeer, owner_of("arm", ""));
  CHECK(door.met == 1);
  CHECK(door.admission.excluded().empty());
}

TEST_CASE("admission: without keys, an owner that has some is named") {
  Door door("");
  door.admission.discovered(kPeer, owner_of("arm", "1"));
  CHECK(door.met == 0);
  CHECK_FALSE(door.admission.awaits_authentication());
  REQUIRE(door.admission.excluded().size() == 1);
  CHECK_THAT(door.admission.excluded()[0],
             ContainsSubstring("'arm'") && ContainsSubstring("needs keys"));
  door.admission.left(kPeer);
  CHECK(door.admission.excluded().empty());
}

TEST_CASE("admission: an owner that is never verified is not awaited for ever") {
  Door door("1");
  door.admission.discovered(kPeer, owner_of("arm", "1"));
  const auto now = Admission::Clock::now();
  CHECK(door.admission.awaits_authentication(now));
  CHECK_FALSE(door.admission.awaits_authentication(now + Admission::kAwaitedFor));
}

TEST_CASE("admission: with keys, only who is verified is met, in whatever order that is told") {
  Door door("1");
  SECTION("discovered first") {
    door.admission.discovered(kPeer, owner_of("arm", "1"));
    CHECK(door.met == 0);
    CHECK(door.admission.awaits_authentication());
    door.admission.authenticated(kPeer, true);
  }
  SECTION("verified first") {
    door.admission.authenticated(kPeer, true);
    CHECK(door.met == 0);
    door.admission.discovered(kPeer, owner_of("arm", "1"));
  }
  CHECK(door.met == 1);
  CHECK_FALSE(door.admission.awaits_authentication());
  CHECK(door.admission.excluded().empty());
}

TEST_CASE("admission: with keys, it is told why an owner is excluded") {
  Door door("1");
  const auto reason = [&](const std::string& authority, bool rejected) {
    door.admission.discovered(kPeer, owner_of("arm", authority));
    if (rejected) door.admission.authenticated(kPeer, false);
    CHECK(door.met == 0);
    CHECK_FALSE(door.admission.awaits_authentication());
    const auto excluded = door.admission.excluded();
    door.admission.left(kPeer);
    return excluded.size() == 1 ? excluded[0] : "";
  };
  CHECK_THAT(reason("", false), ContainsSubstring("has no keys"));
  CHECK_THAT(reason("2", true), ContainsSubstring("of another authority"));
  CHECK_THAT(reason("1", true), ContainsSubstring("expired or revoked"));
}

TEST_CASE("admission: clients and other programs are excluded in silence") {
  Door door("1");
  door.admission.discovered(kPeer, owner_of("", ""));
  door.admission.discovered(PeerId{2}, Announcement{});
  CHECK(door.met == 0);
  CHECK(door.admission.excluded().empty());
  CHECK_FALSE(door.admission.awaits_authentication());
}

// Lock ranks are checked without NDEBUG.
TEST_CASE("admission: whether somebody is awaited can be asked while a message is received") {
  Door door("1");
  door.admission.discovered(kPeer, owner_of("arm", "1"));
  Mutex receiving(LockRank::kReceiving);
  const Lock lock(receiving);
  CHECK(door.admission.awaits_authentication());
}

TEST_CASE("admission: an identity is awaited until the callback has ended") {
  Admission* asked = nullptr;
  std::vector<bool> awaited;
  Admission admission{[&](const PeerId&, const Announcement&) {
    awaited.push_back(asked->awaits_authentication());
  }};
  asked = &admission;
  admission.configure("1");
  admission.discovered(kPeer, owner_of("arm", "1"));
  admission.authenticated(kPeer, true);
  CHECK(awaited == std::vector<bool>{true});
  CHECK_FALSE(admission.awaits_authentication());
}

}  // namespace
}  // namespace tfdude::fastdds
