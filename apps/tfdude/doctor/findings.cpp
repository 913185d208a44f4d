#include <algorithm>
#include <cmath>
#include <set>

#include "tfdude/base/id.hpp"

#include "../../rendering/format.hpp"
#include "../../rendering/table.hpp"
#include "../../rendering/text.hpp"
#include "facts.hpp"

// Each function judges one kind of facts, and adds what it finds.
namespace tfdude::cli {
namespace {

using Findings = std::vector<Finding>;

std::string quoted(std::vector<std::string> names) {
  for (std::string& name : names) name = quote(name);
  return joined(names);
}

std::string process_of(const PartitionInfo& partition) {
  return "process " + std::to_string(partition.pid) + " on host " + quote(partition.host);
}

bool by_multicast(const Facts& facts) { return facts.discovery_server.empty(); }

void judge_keys(const Facts& facts, Findings& findings) {
  if (facts.keys && !*facts.keys) {
    findings.push_back({"keys_invalid", (*facts.keys).error().message,
                        "see `tfdude keys check DIR`; make or renew the keys, and copy them here"});
  } else if (facts.keys) {
    const KeyFiles& keys = **facts.keys;
    const auto [first, last] = keys.settings.domains;
    if (facts.domain < first || facts.domain > last) {
      findings.push_back({"keys_domain",
                          "the keys of " + quote(keys.identity) + " are valid in the domains " +
                              std::to_string(first) + " to " + std::to_string(last) + ", not in " +
                              std::to_string(facts.domain),
                          "give a --domain of the keys, or make a key store with --domains"});
    }
    const auto left = keys.until - facts.now;
    if (left < kKeysTolerance) {
      const auto days = std::chrono::duration_cast<std::chrono::hours>(left).count() / 24;
      findings.push_back({"keys_expire",
                          "the keys of " + quote(keys.identity) + " expire in " +
                              std::to_string(days) + " days, at " + to_string(keys.until),
                          "`tfdude keys renew STORE " + keys.identity +
                              "`, copy the directory here, and restart what uses it"});
    }
  }
  if (facts.failed && facts.failed->code == Errc::kNotPermitted) {
    findings.push_back({"keys_do_not_fit", facts.failed->message,
                        "all participants need keys of one authority, or none has any: "
                        "`tfdude keys check DIR` on each host"});
  }
}

void judge_profile(const Facts& facts, Findings& findings) {
  const Listeners others = facts.others_here();
  const std::size_t other = facts.loopback ? others.everywhere : others.loopback;
  const bool known = !facts.of_other_profile.empty();
  if (!known && (other == 0 || !facts.met.empty())) return;
  std::string who = std::to_string(other) + " participants of this host in domain " +
                    std::to_string(facts.domain);
  if (known)
    who += " (partitions " + quoted(names_of(facts.of_other_profile, &PartitionInfo::name)) + ")";
  findings.push_back(
      {"profile",
       who + (facts.loopback ? " use all network interfaces, and this program 127.0.0.1 only"
                             : " use 127.0.0.1 only, and this program all network interfaces"),
       facts.loopback ? "leave out --local, the loopback profile and TFDUDE_PROFILE, or use them "
                        "for all"
                      : "give --local (or TFDUDE_PROFILE=local) here, or leave it out there"});
}

void judge_domains(const Facts& facts, Findings& findings) {
  for (const auto& [domain, partitions] : facts.elsewhere) {
    if (partitions.empty()) continue;
    findings.push_back(
        {"domain",
         "this host has partitions in domain " + std::to_string(domain) + ": " + quoted(partitions),
         "if they are meant: --domain " + std::to_string(domain) +
             ", or TFDUDE_DOMAIN=" + std::to_string(domain)});
  }
}

void judge_interfaces(const Facts& facts, Findings& findings) {
  bool connected = false;
  for (const NetworkInterface& one : facts.interfaces) {
    connected = connected || (one.up && !one.loopback && !one.address.empty());
    if (one.loopback && !one.up) {
      findings.push_back({"loopback_down", "interface " + one.name + " is down",
                          "ip link set " + one.name + " up"});
    }
  }
  if (connected || facts.loopback) return;
  findings.push_back({"no_network", "no network interface with an IPv4 address is up",
                      "connect the network, then restart all daemons of this host: addresses are "
                      "read at the start. For this host alone: --local"});
}

void judge_multicast(const Facts& facts, Findings& findings) {
  if (!by_multicast(facts)) return;
  for (const NetworkInterface& one : facts.interfaces) {
    if (!one.up || one.address.empty() || one.loopback != facts.loopback) continue;
    if (!one.multicast && !one.loopback) {
      findings.push_back({"no_multicast",
                          "interface " + one.name + " (" + one.address + ") has no multicast",
                          "ip link set " + one.name +
                              " multicast on; if its network passes none: a discovery "
                              "server (--discovery-server)"});
    } else if (one.returns == false) {
      findings.push_back({"multicast_lost",
                          "a multicast message on interface " + one.name + " (" + one.address +
                              ") does not come back",
                          "look for a firewall on this host; if the network passes no multicast: "
                          "a discovery server (--discovery-server)"});
    }
  }
}

void judge_server(const Facts& facts, Findings& findings) {
  if (facts.server_fault.empty()) return;
  findings.push_back({"discovery_server",
                      "the discovery server " + quote(facts.discovery_server) +
                          " cannot be reached: " + facts.server_fault,
                      "start it (examples/discovery-server/start), or correct the address in "
                      "--discovery-server for all participants"});
}

void judge_firewall(const Facts& facts, Findings& findings) {
  if (!facts.firewall) return;
  const Ports ports = ports_of(facts.domain);
  for (const std::string& rule : blocking_rules(*facts.firewall, facts.domain)) {
    findings.push_back({"firewall", "a rule of the firewall may drop messages: " + rule,
                        "accept UDP to the ports " + std::to_string(ports.first) + " to " +
                            std::to_string(ports.last) + ", as in docs/several-hosts.md"});
  }
}

void judge_versions(const Facts& facts, Findings& findings) {
  for (const Met& met : facts.met) {
    const PartitionInfo& partition = met.partition;
    if (partition.compatible()) continue;
    findings.push_back({"version",
                        "partition " + quote(partition.name) + " speaks protocol " +
                            to_string(partition.protocol) + ", this program " +
                            to_string(kProtocolVersion),
                        "install the same version of tf-dude on all hosts"});
  }
}

void judge_reachable(const Facts& facts, Findings& findings) {
  for (const Met& met : facts.met) {
    const PartitionInfo& partition = met.partition;
    if (!partition.compatible() || partition.reachable) continue;
    findings.push_back(
        {"unreachable",
         "partition " + quote(partition.name) + " " + why_absent(partition) + " since " +
             to_string(partition.since),
         "restart its daemon; if it will not return: tfdude forget " + partition.name});
  }
}

// One finding for each host: its largest difference.
void judge_clocks(const Facts& facts, Findings& findings) {
  std::map<std::string, const Met*> worst;
  const auto size = [](const Met& met) {
    return std::chrono::abs(met.clock->ahead) - met.clock->error;
  };
  for (const Met& met : facts.met) {
    if (!met.clock || size(met) < kClockTolerance) continue;
    const Met*& one = worst[met.partition.host];
    if (one == nullptr || size(*one) < size(met)) one = &met;
  }
  for (const auto& [host, met] : worst) {
    const double ahead = std::chrono::duration<double>(met->clock->ahead).count();
    const double error = std::chrono::duration<double>(met->clock->error).count();
    findings.push_back({"clock",
                        "the clock of host " + quote(host) + " is " +
                            format("%.3f s (±%.4f s) ", std::fabs(ahead), error) +
                            (ahead > 0 ? "ahead of" : "behind") + " that of this host (partition " +
                            quote(met->partition.name) + ")",
                        "synchronize the clocks of all hosts by NTP or PTP"});
  }
}

void judge_buffers(const Facts& facts, Findings& findings) {
  const auto judge = [&](const char* name, std::size_t granted, std::size_t wanted) {
    if (granted >= wanted) return;
    findings.push_back({"buffers",
                        "the kernel grants " + std::to_string(granted / 1024) + " KiB of the " +
                            std::to_string(wanted / 1024) + " KiB that are asked for (net.core." +
                            name + "): fast streams lose samples",
                        std::string("sysctl -w net.core.") + name + "=" + std::to_string(wanted) +
                            ", and the same line in /etc/sysctl.d/; then restart all daemons"});
  };
  judge("rmem_max", facts.receive_buffer, kReceiveBuffer);
  if (!facts.loopback) judge("wmem_max", facts.send_buffer, kSendBuffer);
}

// One name, two processes that do not see each other.
void judge_names(const Facts& facts, Findings& findings) {
  for (const Met& met : facts.met) {
    const PartitionInfo& here = met.partition;
    for (const PartitionInfo& there : facts.of_other_profile) {
      if (here.name != there.name || (here.host == there.host && here.pid == there.pid)) continue;
      findings.push_back({"shared_name",
                          "partition " + quote(here.name) +
                              " is served by two processes: " + process_of(here) +
                              ", and with the other profile " + process_of(there),
                          "stop one of them, or give it another --partition"});
    }
  }
}

// Last of all, since the reason is probably among the findings before.
void judge_nobody(const Facts& facts, Findings& findings) {
  if (!facts.met.empty()) return;
  const auto here = facts.others.find(facts.domain);
  const bool any = here != facts.others.end() && here->second.any();
  const std::string in =
      "no partition answers in domain " + std::to_string(facts.domain) + " with " + facts.profile;
  // What is wrong with keys was found already.
  const bool by_keys =
      (facts.keys && !*facts.keys) || (facts.failed && facts.failed->code == Errc::kNotPermitted);
  const std::string why = facts.failed && !by_keys ? ": " + facts.failed->message : "";
  std::string remedy = any ? "this host has other participants there; a daemon needs up to a "
                             "second until it serves: look at its log"
                           : "this host has no other participant there: start a daemon "
                             "(tfduded --config FILE.yaml)";
  if (!findings.empty()) remedy = "see the other findings first; then: " + remedy;
  findings.push_back({"nobody", in + why, remedy});
}

}  // namespace

std::vector<Finding> findings_of(const Facts& facts) {
  Findings findings;
  for (const auto judge :
       {judge_keys, judge_profile, judge_domains, judge_interfaces, judge_multicast, judge_server,
        judge_firewall, judge_versions, judge_names, judge_reachable, judge_clocks, judge_buffers,
        judge_nobody}) {
    judge(facts, findings);
  }
  return findings;
}

std::vector<std::string> unchecked_of(const Facts& facts) {
  std::vector<std::string> unchecked;
  if (!facts.firewall) {
    unchecked.emplace_back(
        "firewall: only root can read its rules (nft list ruleset): sudo tfdude doctor");
  }
  if (by_multicast(facts)) {
    for (const NetworkInterface& one : facts.interfaces) {
      const bool used = one.up && !one.address.empty() && one.loopback == facts.loopback;
      if (used && (one.multicast || one.loopback) && !one.returns) {
        unchecked.push_back("multicast of interface " + one.name + ": no socket for it");
      }
    }
  }
  std::set<std::string> hosts;
  for (const Met& met : facts.met) {
    if (met.partition.reachable && !met.clock) hosts.insert(met.partition.host);
  }
  for (const std::string& host : hosts) {
    unchecked.push_back("clock of host " + quote(host) +
                        ": it did not answer, or may not be asked with these keys");
  }
  return unchecked;
}

}  // namespace tfdude::cli
