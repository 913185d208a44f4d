#include "keys/permissions.hpp"

#include <algorithm>
#include <array>
#include <ctime>
#include <set>
#include <string>
#include <string_view>
#include <tinyxml2.h>
#include <vector>

#include "tfdude/base/id.hpp"

#include "types/topic_names.hpp"

namespace tfdude::keys {
namespace {

/// Which roles may use a topic; determines also in which DDS partitions.
enum class Right {
  kServe,   // in its own partition
  kAll,     // in all
  kLook,    // in all
  kChange,  // in those that it may change
  kStream,  // in those that it may change, or stream to
  kClock,   // in all
};

struct Access {
  const char* topic = nullptr;
  const char* direction = nullptr;
  Right right = Right::kAll;
  const char* below = "";  // after the partition's name
};

constexpr const char* kPublish = "publish";
constexpr const char* kSubscribe = "subscribe";

/// All that travels. Lines of one direction that name the same partitions become one rule, others
/// do not: within one rule, Fast DDS allows each of its topics in the partitions of all others, and
/// only the first rule for a topic counts.
constexpr std::array<Access, 18> kTable{{
    {kPresenceTopic, kPublish, Right::kServe},
    {kPresenceTopic, kSubscribe, Right::kAll},
    {kDirectoryTopic, kPublish, Right::kServe},
    {kDirectoryTopic, kSubscribe, Right::kAll},
    {kRequestTopic, kPublish, Right::kLook},
    {kRequestTopic, kSubscribe, Right::kServe},
    {kChangeTopic, kPublish, Right::kChange},
    {kChangeTopic, kSubscribe, Right::kServe},
    {kReplyTopic, kPublish, Right::kServe, "/*"},  // P/RECEIVER
    {kReplyTopic, kSubscribe, Right::kLook},       // */RECEIVER
    {kStateTopic, kPublish, Right::kServe, "/*"},  // P/GROUP
    {kStateTopic, kSubscribe, Right::kLook},
    {kUpdateTopic, kPublish, Right::kStream},
    {kUpdateTopic, kSubscribe, Right::kServe},
    {kJointTopic, kPublish, Right::kStream},
    {kJointTopic, kSubscribe, Right::kServe},
    {kClockTopic, kPublish, Right::kClock},
    {kClockTopic, kSubscribe, Right::kAll},
}};

// Also a pattern of Fast DDS: fnmatch() without escapes.
constexpr const char* kAllPartitions = "*";

std::set<std::string> partitions_of(const Access& access, const Roles& roles) {
  std::set<std::string> names;
  switch (access.right) {
    case Right::kServe:
      if (roles.serves) names.insert(*roles.serves);
      break;
    case Right::kAll:
      names.insert(kAllPartitions);
      break;
    case Right::kLook:
      if (roles.look) names.insert(kAllPartitions);
      break;
    case Right::kChange:
      names = roles.move;
      if (roles.observe) names.insert(kAllPartitions);
      break;
    case Right::kStream:
      names = roles.move;
      names.insert(roles.stream.begin(), roles.stream.end());
      break;
    case Right::kClock:
      if (roles.clock) names.insert(kAllPartitions);
      break;
  }
  std::set<std::string> partitions;
  for (const std::string& name : names) partitions.insert(name + access.below);
  return partitions;
}

enum class Layout { kIndented, kCompact };

class Printer : public tinyxml2::XMLPrinter {
 public:
  explicit Printer(Layout layout) : compact(layout == Layout::kCompact) {}
  const bool compact;
};

/// Writes XML. An element is open as long as its object exists.
class Element {
 public:
  Element(Printer& xml, const char* name) : xml_(xml) { xml_.OpenElement(name, xml_.compact); }
  ~Element() { xml_.CloseElement(xml_.compact); }
  Element(const Element&) = delete;
  Element& operator=(const Element&) = delete;

 private:
  Printer& xml_;
};

void write(Printer& xml, const char* name, const std::string& text) {
  const Element element(xml, name);
  xml.PushText(text.c_str());
}

void write_domains(Printer& xml, const DomainRange& range) {
  const Element domains(xml, "domains");
  // To Fast DDS, a range that ends with 0 has no end.
  if (range.first == range.last) return write(xml, "id", std::to_string(range.first));
  const Element id_range(xml, "id_range");
  write(xml, "min", std::to_string(range.first));
  write(xml, "max", std::to_string(range.last));
}

/// Topics that are allowed in one direction in the same partitions.
struct Rule {
  std::string direction;
  std::set<std::string> partitions;
  std::vector<std::string> topics;
};

std::vector<Rule> rules_of(const Roles& roles) {
  std::vector<Rule> rules;
  for (const Access& access : kTable) {
    const std::set<std::string> partitions = partitions_of(access, roles);
    if (partitions.empty()) continue;
    auto same = std::find_if(rules.begin(), rules.end(), [&](const Rule& rule) {
      return rule.direction == access.direction && rule.partitions == partitions;
    });
    if (same == rules.end()) same = rules.insert(rules.end(), {access.direction, partitions, {}});
    same->topics.emplace_back(access.topic);
  }
  return rules;
}

void write_rule(Printer& xml, const Rule& rule, const DomainRange& domains) {
  const Element element(xml, "allow_rule");
  write_domains(xml, domains);
  const Element direction(xml, rule.direction.c_str());
  {
    const Element topics(xml, "topics");
    for (const std::string& topic : rule.topics) write(xml, "topic", topic);
  }
  const Element names(xml, "partitions");
  for (const std::string& partition : rule.partitions) write(xml, "partition", partition);
}

std::string one_rule_a_line(std::string text) {
  constexpr std::string_view kRule = "<allow_rule>";
  for (auto at = text.find(kRule); at != std::string::npos; at = text.find(kRule, at)) {
    text.insert(at, 1, '\n');
    at += 1 + kRule.size();
  }
  return text;
}

std::string date_of(Time time) {
  const std::time_t seconds = std::chrono::system_clock::to_time_t(time);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  std::array<char, 32> text{};
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &parts)};
}

tl::unexpected<Error> malformed(const std::string& what) {
  return fail(Errc::kConfig, "is no document of tfdude keys: " + what);
}

std::string text_of(const tinyxml2::XMLElement* element) {
  const char* text = element == nullptr ? nullptr : element->GetText();
  return text == nullptr ? "" : text;
}

const tinyxml2::XMLElement* child(const tinyxml2::XMLElement* element, const char* name) {
  return element == nullptr ? nullptr : element->FirstChildElement(name);
}

Result<Time> read_date(const tinyxml2::XMLElement* element) {
  const std::string text = text_of(element);
  std::tm parts{};
  const char* end = strptime(text.c_str(), "%Y-%m-%dT%H:%M:%S", &parts);
  if (end == nullptr || *end != '\0') return malformed(quote(text) + " is no date");
  return std::chrono::system_clock::from_time_t(timegm(&parts));
}

Result<DomainRange> read_domains(const tinyxml2::XMLElement* domains) {
  DomainRange range;
  if (const auto* id = child(domains, "id")) {
    if (id->QueryUnsignedText(&range.first) != tinyxml2::XML_SUCCESS) return malformed("a domain");
    range.last = range.first;
    return range;
  }
  const auto* ends = child(domains, "id_range");
  const auto* min = child(ends, "min");
  const auto* max = child(ends, "max");
  if (min == nullptr || max == nullptr ||
      min->QueryUnsignedText(&range.first) != tinyxml2::XML_SUCCESS ||
      max->QueryUnsignedText(&range.last) != tinyxml2::XML_SUCCESS) {
    return malformed("no range of domains");
  }
  return range;
}

// Adds to the roles what a line of the table allows in a partition. Some lines add nothing, because
// several belong to one role.
void add_access(Roles& roles, const Access& access, const std::string& partition) {
  switch (access.right) {
    case Right::kServe:
      if (*access.below == '\0') roles.serves = partition;
      break;
    case Right::kAll:
      break;
    case Right::kLook:
      roles.look = true;
      break;
    case Right::kChange:
      if (partition == kAllPartitions) {
        roles.observe = true;
      } else {
        roles.move.insert(partition);
      }
      break;
    case Right::kStream:
      roles.stream.insert(partition);
      break;
    case Right::kClock:
      roles.clock = true;
      break;
  }
}

bool names_topic(const tinyxml2::XMLElement* direction, const std::string& name) {
  const auto* topic = child(child(direction, "topics"), "topic");
  while (topic != nullptr && text_of(topic) != name) topic = topic->NextSiblingElement("topic");
  return topic != nullptr;
}

void read_rule(const tinyxml2::XMLElement& rule, Roles& roles) {
  for (const Access& access : kTable) {
    const auto* direction = child(&rule, access.direction);
    if (!names_topic(direction, access.topic)) continue;
    const auto* partition = child(child(direction, "partitions"), "partition");
    for (; partition != nullptr; partition = partition->NextSiblingElement("partition")) {
      add_access(roles, access, text_of(partition));
    }
  }
}

// The element below the root, if the document has this shape.
const tinyxml2::XMLElement* open(tinyxml2::XMLDocument& document, const std::string& text,
                                 const char* name) {
  if (document.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS) return nullptr;
  return child(document.FirstChildElement("dds"), name);
}

}  // namespace

// They travel in each handshake, for which Fast DDS 3.1 has room for 8 KiB.
std::string permissions_of(const Grant& grant) {
  Printer xml(Layout::kCompact);
  xml.PushHeader(false, true);
  {
    const Element dds(xml, "dds");
    const Element permissions(xml, "permissions");
    const Element element(xml, "grant");
    xml.PushAttribute("name", grant.subject.c_str());
    write(xml, "subject_name", grant.subject);
    {
      const Element validity(xml, "validity");
      write(xml, "not_before", date_of(grant.not_before));
      write(xml, "not_after", date_of(grant.not_after));
    }
    for (const Rule& rule : rules_of(grant.roles)) write_rule(xml, rule, grant.domains);
    write(xml, "default", "DENY");
  }
  return one_rule_a_line(xml.CStr());
}

Result<Grant> read_permissions(const std::string& text) {
  tinyxml2::XMLDocument document;
  const auto* element = child(open(document, text, "permissions"), "grant");
  if (element == nullptr) return malformed("it has no grant");
  Grant grant;
  grant.subject = text_of(child(element, "subject_name"));
  const auto* validity = child(element, "validity");
  const auto not_before = read_date(child(validity, "not_before"));
  if (!not_before) return tl::unexpected(not_before.error());
  const auto not_after = read_date(child(validity, "not_after"));
  if (!not_after) return tl::unexpected(not_after.error());
  grant.not_before = *not_before;
  grant.not_after = *not_after;
  const auto* rule = child(element, "allow_rule");
  const auto domains = read_domains(child(rule, "domains"));
  if (!domains) return tl::unexpected(domains.error());
  grant.domains = *domains;
  for (; rule != nullptr; rule = rule->NextSiblingElement("allow_rule")) {
    read_rule(*rule, grant.roles);
  }
  auto roles = complete(grant.roles);
  if (!roles) return malformed(roles.error().message);
  grant.roles = *std::move(roles);
  return grant;
}

std::string governance_of(const KeySettings& settings) {
  const std::string kind = settings.encrypt ? "ENCRYPT" : "SIGN";
  Printer xml(Layout::kIndented);
  xml.PushHeader(false, true);
  {
    const Element dds(xml, "dds");
    const Element rules(xml, "domain_access_rules");
    const Element rule(xml, "domain_rule");
    write_domains(xml, settings.domains);
    write(xml, "allow_unauthenticated_participants", "false");
    write(xml, "enable_join_access_control", "true");
    write(xml, "discovery_protection_kind", kind);
    write(xml, "liveliness_protection_kind", kind);
    // Protects whole messages. Protecting their parts or the data instead costs more. It would also
    // protect from insiders with changed software, see docs/security.md.
    write(xml, "rtps_protection_kind", kind);
    const Element topic_rules(xml, "topic_access_rules");
    const Element topic_rule(xml, "topic_rule");
    write(xml, "topic_expression", "*");
    for (const char* enabled : {"enable_discovery_protection", "enable_liveliness_protection",
                                "enable_read_access_control", "enable_write_access_control"}) {
      write(xml, enabled, "true");
    }
    write(xml, "metadata_protection_kind", "NONE");
    write(xml, "data_protection_kind", "NONE");
  }
  return xml.CStr();
}

Result<KeySettings> read_governance(const std::string& text) {
  tinyxml2::XMLDocument document;
  const auto* rule = child(open(document, text, "domain_access_rules"), "domain_rule");
  if (rule == nullptr) return malformed("it has no rule for domains");
  const auto domains = read_domains(child(rule, "domains"));
  if (!domains) return tl::unexpected(domains.error());
  return KeySettings{text_of(child(rule, "rtps_protection_kind")) == "ENCRYPT", *domains};
}

}  // namespace tfdude::keys
