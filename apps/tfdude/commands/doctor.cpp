#include "tfdude/base/id.hpp"

#include "../../rendering/format.hpp"
#include "../../rendering/quantities.hpp"
#include "../../rendering/terminal.hpp"
#include "../commands.hpp"
#include "../doctor/domain_facts.hpp"

namespace tfdude::cli {
namespace {

using nlohmann::json;

json met_json(const Met& met) {
  json object{{"partition", met.partition.name},
              {"host", nullptr},
              {"pid", nullptr},
              {"reachable", met.partition.reachable},
              {"clock_ahead_s", nullptr},
              {"clock_error_s", nullptr}};
  if (!met.partition.host.empty()) {
    object["host"] = met.partition.host;
    object["pid"] = met.partition.pid;
  }
  if (met.partition.reachable) {
    object["in_memory"] = met.partition.in_memory;
    object["why_not_in_memory"] = met.partition.why_not_in_memory;
  }
  if (met.clock) {
    object["clock_ahead_s"] = seconds(met.clock->ahead);
    object["clock_error_s"] = seconds(met.clock->error);
  }
  return object;
}

std::string met_text(const Met& met) {
  const PartitionInfo& partition = met.partition;
  if (!partition.reachable && partition.compatible()) {
    const char* how = partition.silent ? "silent" : partition.stopped ? "stopped" : "lost";
    return format("%-12s ", how) + partition.name + ", since " + to_string(partition.since) + "\n";
  }
  std::string text = "met          " + partition.name + " on " + partition.host + ", process " +
                     std::to_string(partition.pid);
  if (met.clock) {
    text += format(", clock %+.3f ms (±%.3f)", 1e3 * seconds(met.clock->ahead),
                   1e3 * seconds(met.clock->error));
  }
  if (partition.in_memory) text += ", read in its memory";
  if (!partition.why_not_in_memory.empty()) {
    text += ", asked over DDS: " + partition.why_not_in_memory;
  }
  return text + "\n";
}

std::string interfaces_text(const std::vector<NetworkInterface>& interfaces) {
  std::string text;
  for (const NetworkInterface& one : interfaces) {
    if (!one.up || one.address.empty()) continue;
    text += (text.empty() ? "interfaces   " : ", ") + one.name + " " + one.address;
  }
  return text + (text.empty() ? "" : "\n");
}

struct Doctor final : Command {
  explicit Doctor(CLI::App& app) {
    app.footer("Exit status: 0 no problem found, 1 problems found, 2 wrong usage.\n" +
               app.get_footer());
  }

  int run(const Common& common) const override {
    const Facts facts = gather_facts(common.options);
    const auto findings = findings_of(facts);
    const auto unchecked = unchecked_of(facts);
    json object{{"domain", facts.domain},
                {"met", json::array()},
                {"findings", json::array()},
                {"unchecked", unchecked}};
    std::string text = "domain       " + std::to_string(facts.domain) + ", " + facts.profile +
                       "\n" + interfaces_text(facts.interfaces);
    for (const Met& met : facts.met) {
      object["met"].push_back(met_json(met));
      text += met_text(met);
    }
    for (const std::string& one : unchecked)
      text += painted(Look::kWarning, "not checked  " + one) + "\n";
    for (const Finding& finding : findings) {
      object["findings"].push_back(
          {{"code", finding.code}, {"what", finding.what}, {"remedy", finding.remedy}});
      text += "\n" + painted(Look::kBad, finding.code + ":") + " " + printable(finding.what) +
              "\n  -> " + printable(finding.remedy) + "\n";
    }
    if (findings.empty()) text += "\n" + painted(Look::kGood, "no problem found") + "\n";
    (void)answer(common, object, text);
    return findings.empty() ? kDone : kRejected;
  }
};

}  // namespace

void add_doctor(Commands& commands) {
  commands.add<Doctor>("doctor", "find out why no partition answers, and what to do", "doctor");
}

}  // namespace tfdude::cli
