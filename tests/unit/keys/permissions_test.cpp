#include "keys/permissions.hpp"

#include <fnmatch.h>
#include <set>
#include <string>
#include <tinyxml2.h>
#include <vector>

#include "support/catch.hpp"
#include "support/key_store.hpp"
#include "types/topic_names.hpp"

namespace tfdude {
namespace {

using keys::Grant;
using keys::permissions_of;
using keys::read_permissions;
using testing::ContainsSubstring;
using testing::daemon_of;
using testing::kKeysTime;
using testing::looking;
using testing::moving;
using testing::observing;
using testing::streaming;

const std::vector<std::string> kTopics = {kRequestTopic,   kChangeTopic,   kReplyTopic,
                                          kUpdateTopic,    kJointTopic,    kStateTopic,
                                          kDirectoryTopic, kPresenceTopic, kClockTopic};

Grant granted(const Roles& roles) {
  return {"CN=arm 1", *complete(roles), {3, 7}, kKeysTime, kKeysTime + std::chrono::hours(1)};
}

/// Decides as Fast DDS does: the first rule for the topic counts, and all its partitions.
class Decision {
 public:
  explicit Decision(const Roles& roles) {
    REQUIRE(document_.Parse(permissions_of(granted(roles)).c_str()) == tinyxml2::XML_SUCCESS);
    grant_ = document_.RootElement()->FirstChildElement("permissions")->FirstChildElement("grant");
    CHECK(grant_->LastChildElement()->Name() == std::string("default"));
    CHECK(grant_->LastChildElement()->GetText() == std::string("DENY"));
  }

  [[nodiscard]] bool publishes(const std::string& topic, const std::string& partition) const {
    return allowed("publish", topic, partition);
  }
  [[nodiscard]] bool subscribes(const std::string& topic, const std::string& partition) const {
    return allowed("subscribe", topic, partition);
  }

  /// Checks that each rule is about one direction, and no two about the same topic in it.
  void check_rules() const {
    std::set<std::string> seen;
    for (const auto* rule = grant_->FirstChildElement("allow_rule"); rule != nullptr;
         rule = rule->NextSiblingElement("allow_rule")) {
      const auto* direction = rule->FirstChildElement("domains")->NextSiblingElement();
      CHECK(direction->NextSiblingElement() == nullptr);
      for (const auto* topic = direction->FirstChildElement("topics")->FirstChildElement();
           topic != nullptr; topic = topic->NextSiblingElement()) {
        CHECK(seen.insert(std::string(direction->Name()) + topic->GetText()).second);
      }
    }
  }

 private:
  [[nodiscard]] bool allowed(const char* direction, const std::string& topic,
                             const std::string& partition) const {
    for (const auto* rule = grant_->FirstChildElement("allow_rule"); rule != nullptr;
         rule = rule->NextSiblingElement("allow_rule")) {
      const auto* criteria = rule->FirstChildElement(direction);
      if (criteria == nullptr) continue;
      const auto* named = criteria->FirstChildElement("topics")->FirstChildElement();
      while (named != nullptr && named->GetText() != topic) named = named->NextSiblingElement();
      if (named == nullptr) continue;
      for (const auto* one = criteria->FirstChildElement("partitions")->FirstChildElement();
           one != nullptr; one = one->NextSiblingElement()) {
        if (fnmatch(one->GetText(), partition.c_str(), FNM_NOESCAPE) == 0) return true;
      }
      return false;
    }
    return false;
  }

  tinyxml2::XMLDocument document_;
  const tinyxml2::XMLElement* grant_ = nullptr;
};

Roles all_roles() {
  Roles roles = daemon_of("base");
  roles.move = {"arm", "left hand"};
  roles.stream = {"legs"};
  roles.observe = true;
  return roles;
}

}  // namespace

TEST_CASE("permissions: a daemon serves its partition and looks at others") {
  const Decision arm(daemon_of("arm"));
  arm.check_rules();
  for (const char* topic : {kPresenceTopic, kDirectoryTopic}) {
    CHECK(arm.publishes(topic, "arm"));
    CHECK(arm.subscribes(topic, "*"));
    for (const char* other : {"base", "", "*", "arm/x", "arms", "a*"}) {
      CHECK_FALSE(arm.publishes(topic, other));
    }
  }
  for (const char* topic : {kReplyTopic, kStateTopic}) {
    CHECK(arm.publishes(topic, "arm/0123"));
    for (const char* other : {"base/0123", "arm", "*", "*/0123", "arms/0123"}) {
      CHECK_FALSE(arm.publishes(topic, other));
    }
    CHECK(arm.subscribes(topic, "*/0123"));
  }
  for (const char* topic : {kRequestTopic, kChangeTopic, kUpdateTopic, kJointTopic}) {
    CHECK(arm.subscribes(topic, "arm"));
    for (const char* other : {"base", "", "*", "arms"}) CHECK_FALSE(arm.subscribes(topic, other));
  }
  CHECK(arm.publishes(kRequestTopic, "base"));
  CHECK(arm.publishes(kRequestTopic, "*"));
  for (const char* topic : {kChangeTopic, kUpdateTopic, kJointTopic}) {
    for (const char* partition : {"arm", "base", "*", ""}) {
      CHECK_FALSE(arm.publishes(topic, partition));
    }
  }
}

TEST_CASE("permissions: only who may ask reads replies") {
  for (const Roles& roles : {looking(), moving("arm"), observing(), daemon_of("arm")}) {
    CHECK(Decision(roles).subscribes(kReplyTopic, "*/0123"));
  }
  Roles clock;
  clock.clock = true;
  for (const Roles& roles : {streaming("arm"), clock}) {
    const Decision deaf(roles);
    deaf.check_rules();
    for (const char* partition : {"*/0123", "arm/0123", "*", "*/*", ""}) {
      CHECK_FALSE(deaf.subscribes(kReplyTopic, partition));
      CHECK_FALSE(deaf.subscribes(kStateTopic, partition));
    }
    CHECK(deaf.subscribes(kDirectoryTopic, "*"));
  }
}

TEST_CASE("permissions: a client that may look changes nothing") {
  const Decision client(looking());
  client.check_rules();
  CHECK(client.publishes(kRequestTopic, "arm"));
  CHECK(client.subscribes(kStateTopic, "arm/group"));
  CHECK(client.subscribes(kReplyTopic, "*/0123"));
  for (const std::string& topic : kTopics) {
    if (topic != kRequestTopic) CHECK_FALSE(client.publishes(topic, "arm"));
  }
  CHECK_FALSE(client.subscribes(kRequestTopic, "arm"));
  CHECK_FALSE(client.publishes("another/topic", "arm"));
  CHECK_FALSE(client.subscribes("another/topic", "*"));
}

TEST_CASE("permissions: a client that may move changes only its partitions") {
  Roles roles = moving("arm");
  roles.move.insert("base");
  const Decision client(roles);
  client.check_rules();
  for (const char* topic : {kChangeTopic, kUpdateTopic, kJointTopic}) {
    CHECK(client.publishes(topic, "arm"));
    CHECK(client.publishes(topic, "base"));
    for (const char* other : {"legs", "*", "", "arm*"}) CHECK_FALSE(client.publishes(topic, other));
  }
  CHECK(client.publishes(kRequestTopic, "legs"));
  CHECK_FALSE(client.publishes(kReplyTopic, "arm/0123"));
}

TEST_CASE("permissions: all hear the time, and only who may publishes it") {
  Roles roles = looking();
  CHECK_FALSE(Decision(roles).publishes(kClockTopic, ""));
  CHECK(Decision(roles).subscribes(kClockTopic, ""));
  roles.clock = true;
  const Decision client(roles);
  client.check_rules();
  CHECK(client.publishes(kClockTopic, ""));
  CHECK_FALSE(client.publishes(kUpdateTopic, ""));
  const auto again = read_permissions(permissions_of(granted(roles)));
  REQUIRE(again);
  CHECK(again->roles.clock);
  Roles only;
  only.clock = true;
  CHECK(complete(only));
}

TEST_CASE("permissions: a client that may stream sends no requests") {
  const Decision client(streaming("arm"));
  client.check_rules();
  for (const char* topic : {kUpdateTopic, kJointTopic}) {
    CHECK(client.publishes(topic, "arm"));
    CHECK_FALSE(client.publishes(topic, "base"));
    CHECK_FALSE(client.publishes(topic, "*"));
  }
  CHECK_FALSE(client.publishes(kRequestTopic, "arm"));
  CHECK_FALSE(client.publishes(kChangeTopic, "arm"));
  CHECK_FALSE(client.subscribes(kStateTopic, "arm/group"));
  CHECK(client.subscribes(kDirectoryTopic, "*"));
}

TEST_CASE("permissions: a client that may observe sends changes to all and streams to none") {
  const Decision client(observing());
  client.check_rules();
  for (const char* partition : {"arm", "base", "*"}) {
    CHECK(client.publishes(kChangeTopic, partition));
    CHECK_FALSE(client.publishes(kUpdateTopic, partition));
  }
}

TEST_CASE("permissions: written permissions are read back") {
  Roles odd = daemon_of(std::string(255, '&'));
  odd.move = {"<a> \"b'", "\\", "漢"};
  for (const Roles& roles : {all_roles(), odd, daemon_of("arm"), looking(), moving("arm"),
                             streaming("arm"), observing()}) {
    Decision(roles).check_rules();
    const Grant grant = granted(roles);
    const auto read = read_permissions(permissions_of(grant));
    REQUIRE(read);
    CHECK(read->roles == grant.roles);
    CHECK(read->subject == grant.subject);
    CHECK(read->domains == grant.domains);
    CHECK(read->not_before == grant.not_before);
    CHECK(read->not_after == grant.not_after);
  }
}

TEST_CASE("permissions: dates and domains are written as Fast DDS reads them") {
  Grant grant = granted(looking());
  CHECK_THAT(permissions_of(grant),
             ContainsSubstring("<not_before>2030-03-17T17:46:40</not_before>") &&
                 ContainsSubstring("<min>3</min>") && ContainsSubstring("<max>7</max>"));
  grant.domains = {0, 0};
  CHECK_THAT(permissions_of(grant), ContainsSubstring("<id>0</id>") && !ContainsSubstring("<max>"));
  CHECK(read_permissions(permissions_of(grant))->domains == DomainRange{0, 0});
}

TEST_CASE("permissions: other documents are rejected") {
  const std::string good = permissions_of(granted(looking()));
  const auto without = [&](const std::string& part) {
    std::string text = good;
    text.erase(text.find(part), part.size());
    return text;
  };
  for (const std::string& text :
       {std::string(), std::string("<dds>"), std::string("<dds><permissions/></dds>"),
        keys::governance_of({}), without("2030-03-17T17:46:40"), without("T17:46:40"),
        without("<min>3</min>"), good.substr(0, good.size() / 2)}) {
    const auto read = read_permissions(text);
    REQUIRE_FALSE(read);
    CHECK(read.error().code == Errc::kConfig);
  }
}

TEST_CASE("governance: protects everything by encryption or signature") {
  for (const bool encrypt : {true, false}) {
    const KeySettings settings{encrypt, {5, 9}};
    const std::string text = keys::governance_of(settings);
    const std::string kind = encrypt ? "ENCRYPT" : "SIGN";
    for (const char* layer : {"discovery", "liveliness", "rtps"}) {
      const std::string tag = std::string(layer) + "_protection_kind>";
      CHECK_THAT(text, ContainsSubstring("<" + tag + kind + "</" + tag));
    }
    CHECK_THAT(text, ContainsSubstring("<allow_unauthenticated_participants>false<") &&
                         ContainsSubstring("<enable_join_access_control>true<") &&
                         ContainsSubstring("<enable_read_access_control>true<") &&
                         ContainsSubstring("<enable_write_access_control>true<"));
    const auto read = keys::read_governance(text);
    REQUIRE(read);
    CHECK(*read == settings);
  }
  CHECK_FALSE(keys::read_governance("<dds/>"));
}

TEST_CASE("roles: are completed, and say what they mean") {
  for (const char* name : {"", "a*", "a/b", " a", "a ", "a,b", "a\n"}) {
    for (const Roles& roles : {daemon_of(name), moving(name), streaming(name)}) {
      const auto completed = complete(roles);
      REQUIRE_FALSE(completed);
      CHECK(completed.error().code == Errc::kInvalidInput);
      CHECK_THAT(completed.error().message, ContainsSubstring("partition"));
    }
  }
  CHECK_FALSE(complete(Roles()));
  CHECK(complete(observing())->look);
  CHECK_FALSE(complete(streaming("arm"))->look);
  Roles both = moving("arm");
  both.stream = {"arm", "legs"};
  CHECK(complete(both)->stream == std::set<std::string>{"legs"});

  const auto words = in_words(*complete(all_roles()));
  REQUIRE(words.size() == 5);
  CHECK_THAT(words[0], ContainsSubstring("serves partition 'base'"));
  CHECK_THAT(words[2], ContainsSubstring("changes partitions 'arm', 'left hand'"));
  CHECK_THAT(words[3], ContainsSubstring("partition 'legs'"));
  CHECK_THAT(in_words(streaming("arm"))[0], ContainsSubstring("structure only"));
}

}  // namespace tfdude
