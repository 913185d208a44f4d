// `tfdude doctor` on hosts with something wrong: each finding where it can be provoked.

#include <cmath>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "hosts/robot_hosts.hpp"

namespace tfdude {
namespace {

using nlohmann::json;
using testing::await_ready;
using testing::CliResult;
using testing::finish;
using testing::Hosts;
using testing::Process;
using testing::RobotHosts;
using Arguments = std::vector<std::string>;

constexpr std::size_t kHere = 0;
constexpr std::size_t kThere = 1;

void run(const Hosts& hosts, std::size_t host, const std::string& script) {
  Process process = hosts.start(host, {"/bin/sh", "-c", "PATH=/usr/sbin:/sbin:$PATH; " + script});
  const CliResult result = finish(process);
  INFO(result.err);
  REQUIRE(result.status == 0);
}

// The codes that it found here. Buffers depend on the computer that runs the test.
std::set<std::string> codes(const Hosts& hosts, Arguments arguments = {}) {
  arguments.insert(arguments.begin(), {TFDUDE_CLI, "--json", "doctor"});
  Process process = hosts.start(kHere, arguments);
  const CliResult result = finish(process);
  INFO(result.out << result.err);
  const json answer = json::parse(result.out);
  CHECK(result.status == (answer.at("findings").empty() ? 0 : 1));
  std::set<std::string> found;
  for (const json& finding : answer.at("findings")) {
    CHECK_FALSE(finding.at("what").get<std::string>().empty());
    CHECK_FALSE(finding.at("remedy").get<std::string>().empty());
    found.insert(finding.at("code").get<std::string>());
  }
  found.erase("buffers");
  return found;
}

Process serve(const Hosts& hosts, std::size_t host, Arguments arguments = {}) {
  arguments.insert(arguments.begin(),
                   {TFDUDE_DAEMON, "--no-state", "--config", testing::kArmsFile});
  Process daemon = hosts.start(host, arguments);
  (void)await_ready(daemon);
  return daemon;
}

using Codes = std::set<std::string>;

}  // namespace

TEST_CASE("hosts: doctor finds nothing in a network without faults, and who is missing") {
  if (testing::skip_without_hosts()) return;
  const Hosts hosts(2);
  CHECK(codes(hosts) == Codes{"nobody"});
  const Process daemon = serve(hosts, kThere);
  CHECK(codes(hosts).empty());
  CHECK(codes(hosts, {"--domain", "3"}) == Codes{"nobody"});
}

TEST_CASE("hosts: doctor finds other domains and profiles of its host") {
  if (testing::skip_without_hosts()) return;
  const Hosts hosts(2);
  const Process local = serve(hosts, kHere, {"--local"});
  // With Fast DDS 3 participants of the two profiles meet on one host, but not beyond it.
  CHECK(codes(hosts).count("profile") == 1);
  CHECK(codes(hosts, {"--local"}).empty());
  CHECK(codes(hosts, {"--profile", TFDUDE_LOOPBACK_PROFILE}).empty());
  CHECK(codes(hosts, {"--local", "--domain", "3"}) == Codes{"domain", "nobody"});
  const Process wide = serve(hosts, kHere, {"--domain", "3"});
  CHECK(codes(hosts, {"--local", "--domain", "3"}).count("profile") == 1);
}

TEST_CASE("hosts: doctor finds interfaces that are down, and those without multicast") {
  if (testing::skip_without_hosts()) return;
  const Hosts hosts(2);
  const Process daemon = serve(hosts, kThere);
  run(hosts, kHere, "ip link set eth0 multicast off");
  CHECK(codes(hosts).count("no_multicast") == 1);
  run(hosts, kHere, "ip link set eth0 down");
  CHECK(codes(hosts) == Codes{"no_network", "nobody"});
  run(hosts, kHere, "ip link set lo down");
  CHECK(codes(hosts).count("loopback_down") == 1);
}

TEST_CASE("hosts: doctor finds a firewall, and the multicast that it drops") {
  if (testing::skip_without_hosts()) return;
  const Hosts hosts(2);
  const Process daemon = serve(hosts, kThere);
  run(hosts, kHere,
      "nft 'add table inet filter; add chain inet filter input { type filter hook input priority "
      "0; policy drop; }'");
  const Codes found = codes(hosts);
  CHECK(found.count("firewall") == 1);
  CHECK(found.count("multicast_lost") == 1);
  CHECK(found.count("nobody") == 1);
  run(hosts, kHere,
      "nft add rule inet filter input udp dport 7400-7649 accept; "
      "nft add rule inet filter input ip daddr 239.255.116.102 accept");
  CHECK(codes(hosts).empty());
}

TEST_CASE("hosts: doctor finds a discovery server that does not run") {
  if (testing::skip_without_hosts()) return;
  const Hosts hosts(2);
  const std::string server = testing::discovery_address(kThere);
  CHECK(codes(hosts, {"--discovery-server", server}) == Codes{"discovery_server", "nobody"});
  const Process running = testing::start_discovery_server(hosts, kThere);
  CHECK(codes(hosts, {"--discovery-server", server}) == Codes{"nobody"});
  const Process daemon = serve(hosts, kThere, {"--discovery-server", server});
  CHECK(codes(hosts, {"--discovery-server", server}).empty());
}

TEST_CASE("hosts: doctor measures the clock of another host") {
  if (testing::skip_without_hosts()) return;
  const std::string fake = TFDUDE_FAKETIME;
  if (!std::ifstream(fake)) {
    WARN("SKIPPED: needs the package faketime");
    return;
  }
  const Hosts hosts(2);
  Process daemon = hosts.start(
      kThere, {"/usr/bin/env", "FAKETIME=-2.5s", "FAKETIME_DONT_FAKE_MONOTONIC=1",
               "LD_PRELOAD=" + fake, TFDUDE_DAEMON, "--no-state", "--config", testing::kArmsFile});
  (void)await_ready(daemon);
  CHECK(codes(hosts) == Codes{"clock"});
  Process process = hosts.start(kHere, {TFDUDE_CLI, "--json", "doctor"});
  const json met = json::parse(finish(process).out).at("met").at(0);
  const double error = met.at("clock_error_s");
  CHECK(error < 0.1);
  CHECK(std::abs(met.at("clock_ahead_s").get<double>() + 2.5) < error + 0.01);
}

}  // namespace tfdude
