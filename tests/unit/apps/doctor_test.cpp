// The judgement of `tfdude doctor` on given facts.

#include <string>
#include <vector>

#include "tfdude/doctor/facts.hpp"

#include "support/catch.hpp"

namespace tfdude::cli {
namespace {

using namespace std::chrono_literals;
using testing::ContainsSubstring;
using Codes = std::vector<std::string>;

// A host on which nothing is wrong, with two partitions.
Facts healthy() {
  Facts facts;
  facts.profile = "the built-in profile";
  facts.interfaces = {{"lo", "127.0.0.1", true, false, true, {}},
                      {"eth0", "10.0.0.1", true, true, false, true}};
  facts.others[0] = {2, 0};
  facts.firewall = "";
  facts.receive_buffer = kReceiveBuffer;
  facts.send_buffer = kSendBuffer;
  PartitionInfo base{"base", "here", 1, 3, true};
  PartitionInfo arm{"arm", "there", 2, 3, true};
  facts.met = {{base, ClockDifference{1us, 10us}}, {arm, ClockDifference{-3ms, 1ms}}};
  return facts;
}

Codes codes(const Facts& facts) {
  Codes codes;
  for (const Finding& finding : findings_of(facts)) codes.push_back(finding.code);
  return codes;
}

KeyFiles keys_until(Time until) {
  KeyFiles keys;
  keys.identity = "arm";
  keys.settings.domains = {0, 10};
  keys.until = until;
  return keys;
}

}  // namespace

TEST_CASE("doctor: nothing is found where nothing is wrong") {
  CHECK(codes(healthy()).empty());
  CHECK(unchecked_of(healthy()).empty());
}

TEST_CASE("doctor: what could not be read is said, and is no finding") {
  Facts facts = healthy();
  facts.firewall.reset();
  facts.interfaces[1].returns.reset();
  facts.met[1].clock.reset();
  CHECK(codes(facts).empty());
  const auto unchecked = unchecked_of(facts);
  REQUIRE(unchecked.size() == 3);
  CHECK_THAT(unchecked[0], ContainsSubstring("sudo"));
  CHECK_THAT(unchecked[1], ContainsSubstring("eth0"));
  CHECK_THAT(unchecked[2], ContainsSubstring("'there'"));
}

TEST_CASE("doctor: an interface is judged if a participant uses it") {
  Facts facts = healthy();
  facts.interfaces[1].returns = false;
  CHECK(codes(facts) == Codes{"multicast_lost"});
  facts.interfaces[1].multicast = false;
  CHECK(codes(facts) == Codes{"no_multicast"});
  facts.discovery_server = "server:11811";
  CHECK(codes(facts).empty());
  facts.server_fault = "nobody listens there";
  CHECK(codes(facts) == Codes{"discovery_server"});
  facts.server_fault.clear();
  facts.interfaces[1].up = false;
  CHECK(codes(facts) == Codes{"no_network"});
  facts.loopback = true;
  CHECK(codes(facts).empty());
  facts.discovery_server.clear();
  facts.interfaces[0].returns = false;
  CHECK(codes(facts) == Codes{"multicast_lost"});
  facts.interfaces[0].up = false;
  CHECK(codes(facts) == Codes{"loopback_down"});
}

TEST_CASE("doctor: nobody met is found last, after what may be the reason") {
  Facts facts = healthy();
  facts.met.clear();
  facts.others.clear();
  CHECK(codes(facts) == Codes{"nobody"});
  CHECK_THAT(findings_of(facts)[0].remedy, ContainsSubstring("start a daemon"));
  facts.elsewhere = {{7, {"arm"}}, {8, {}}};
  CHECK(codes(facts) == Codes{"domain", "nobody"});
  CHECK_THAT(findings_of(facts)[0].remedy, ContainsSubstring("--domain 7"));
  facts.elsewhere.clear();
  facts.others[0] = {0, 2};
  CHECK(codes(facts) == Codes{"profile", "nobody"});
  CHECK_THAT(findings_of(facts)[0].remedy, ContainsSubstring("give --local"));
  facts.loopback = true;
  CHECK(codes(facts) == Codes{"nobody"});
  facts.others[0] = {2, 0};
  CHECK(codes(facts) == Codes{"profile", "nobody"});
  CHECK_THAT(findings_of(facts)[0].remedy, ContainsSubstring("leave out --local"));
}

TEST_CASE("doctor: a partition with the other profile is found even if others were met") {
  Facts facts = healthy();
  facts.others[0] = {2, 1};
  CHECK(codes(facts).empty());  // it may be of another program
  facts.of_other_profile = {{"legs", "here", 9, 1, true}};
  CHECK(codes(facts) == Codes{"profile"});
  facts.of_other_profile[0].name = "arm";
  CHECK(codes(facts) == Codes{"profile", "shared_name"});
  CHECK_THAT(findings_of(facts)[1].what, ContainsSubstring("process 2 on host 'there'") &&
                                             ContainsSubstring("process 9 on host 'here'"));
}

TEST_CASE("doctor: versions, silence, clocks and buffers are judged") {
  Facts facts = healthy();
  facts.met[1].partition.protocol.major += 1;
  CHECK(codes(facts) == Codes{"version"});
  facts = healthy();
  facts.met[1].partition.reachable = false;
  facts.met[1].clock.reset();
  CHECK(codes(facts) == Codes{"unreachable"});
  facts = healthy();
  facts.met[1].clock = ClockDifference{-1500ms, 100us};
  CHECK(codes(facts) == Codes{"clock"});
  CHECK_THAT(findings_of(facts)[0].what,
             ContainsSubstring("'there' is 1.500 s (±0.0001 s) behind"));
  facts.met[1].clock = ClockDifference{15ms, 10ms};  // it may be 5 ms only
  CHECK(codes(facts).empty());
  facts.receive_buffer = 212992;
  facts.send_buffer = 212992;
  CHECK(codes(facts) == Codes{"buffers", "buffers"});
  CHECK_THAT(findings_of(facts)[0].remedy, ContainsSubstring("net.core.rmem_max=4194304"));
  facts.loopback = true;
  CHECK(codes(facts) == Codes{"buffers"});
}

TEST_CASE("doctor: keys are judged before they end") {
  Facts facts = healthy();
  facts.now = Time(std::chrono::hours(24 * 365));
  facts.keys = keys_until(facts.now + kKeysTolerance + 1h);
  CHECK(codes(facts).empty());
  facts.keys = keys_until(facts.now + 50h);
  CHECK(codes(facts) == Codes{"keys_expire"});
  CHECK_THAT(findings_of(facts)[0].what, ContainsSubstring("in 2 days"));
  facts.keys = keys_until(facts.now + kKeysTolerance + 1h);
  facts.domain = 11;
  facts.others = {};
  CHECK(codes(facts) == Codes{"keys_domain"});
  facts.keys = fail(Errc::kConfig, "keys/arm/key.pem: others can read it");
  CHECK(codes(facts) == Codes{"keys_invalid"});
  facts = healthy();
  facts.met.clear();
  facts.failed = Error{Errc::kNotPermitted, "the keys of 'arm' are of another authority"};
  CHECK(codes(facts) == Codes{"keys_do_not_fit", "nobody"});
}

TEST_CASE("doctor: participants are counted by the ports that they listen on") {
  const auto listeners = listeners_of(sockets_in(
      "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid\n"
      "14964: 0100FFEF:587A 00000000:0000 07 00000000:00000000 00:00000000 00000000 0 0 41 2\n"
      "14974: 0100007F:5884 00000000:0000 07 00000000:00000000 00:00000000 00000000 0 0 42 2\n"
      "14975: 0100007F:5885 00000000:0000 07 00000000:00000000 00:00000000 00000000 0 0 43 2\n"
      "15214: 00000000:5974 00000000:0000 07 00000000:00000000 00:00000000 00000000 0 0 44 2\n"
      "15224: 00000000:597E 00000000:0000 07 00000000:00000000 00:00000000 00000000 0 0 45 2\n"
      "15226: 00000000:5980 00000000:0000 07 00000000:00000000 00:00000000 00000000 0 0 46 2\n"
      // Whatever else uses UDP.
      "13033: 00000000:D0EF 00000000:0000 07 00000000:00000000 00:00000000 00000000 0 0 47 2\n"
      "    1: 00000000:0035 00000000:0000 07 00000000:00000000 00:00000000 00000000 0 0 48 2\n"
      "broken\n"));
  REQUIRE(listeners.size() == 2);
  CHECK(listeners.at(61).loopback == 1);
  CHECK(listeners.at(61).everywhere == 0);
  CHECK(listeners.at(62).everywhere == 2);
  // A client does not listen to multicast.
  const auto own = sockets_in(
      "5: 0100007F:5884 00000000:0000 07 00000000:00000000 00:00000000 00000000 0 0 42 2\n");
  REQUIRE(own.size() == 1);
  CHECK(own[0].inode == 42);
  CHECK(listeners_of(own).empty());
  CHECK(listeners_in(own, 61).loopback == 1);
  CHECK_FALSE(listeners_in(own, 62).any());
}

TEST_CASE("doctor: rules of a firewall count if they concern the domain's messages") {
  const auto blocks = [](const std::string& policy, const std::string& rules) {
    return blocking_rules(
               "table inet filter {\n\tchain input {\n\t\ttype filter hook input priority "
               "filter; policy " +
                   policy + ";\n" + rules + "\t}\n\tchain other {\n\t\tdrop\n\t}\n}\n",
               1)
        .size();
  };
  CHECK(blocks("accept", "") == 0);
  CHECK(blocks("drop", "") == 1);
  CHECK(blocks("drop", "\t\tudp dport 7650-7899 accept\n") == 0);
  CHECK(blocks("drop", "\t\tudp dport { 53, 7000-8000 } accept\n") == 0);
  CHECK(blocks("drop", "\t\tudp dport 7400-7649 accept\n") == 1);  // of domain 0
  CHECK(blocks("accept", "\t\tudp dport 7660 drop\n") == 1);
  CHECK(blocks("accept", "\t\tudp dport 53 drop\n") == 0);
  CHECK(blocks("accept", "\t\tct state invalid drop\n\t\ttcp dport 22 reject\n") == 0);
  CHECK(blocks("accept", "\t\tmeta pkttype multicast drop\n") == 1);
}

}  // namespace tfdude::cli
