#include "partitions.hpp"

#include "../../rendering/format.hpp"
#include "../../rendering/json.hpp"
#include "../../rendering/table.hpp"
#include "../../rendering/terminal.hpp"
#include "../commands.hpp"

namespace tfdude::cli {

std::string partition_table(const std::vector<PartitionRow>& rows) {
  std::vector<std::string> names;
  std::vector<std::string> hosts;
  for (const PartitionRow& row : rows) {
    names.push_back(row.partition.name);
    hosts.push_back(row.partition.host);
  }
  const std::size_t name_columns = name_width(names, 18, 16);
  const std::size_t host_columns = name_width(hosts, 16, 18);
  const auto line = [&](const std::string& name, const std::string& frames, const std::string& host,
                        const std::string& pid, const std::string& samples,
                        const std::string& memory) {
    return cell(name, name_columns) + format(" %8s ", frames.c_str()) + cell(host, host_columns) +
           format(" %8s %10s %12s\n", pid.c_str(), samples.c_str(), memory.c_str());
  };
  std::string text =
      painted(Look::kHeader, line("partition", "frames", "host", "pid", "samples", "history"));
  for (const PartitionRow& row : rows) {
    const PartitionInfo& partition = row.partition;
    // Only the name is known of a partition that was lost before this process started.
    const bool known = !partition.host.empty();
    const bool sampled = row.history && row.history->edges > 0;
    text +=
        line(partition.name, known ? std::to_string(partition.frames) : "-",
             known ? partition.host : "-", known ? std::to_string(partition.pid) : "-",
             sampled ? std::to_string(row.history->samples) : "-",
             sampled ? format("%.1f KiB", static_cast<double>(row.history->bytes) / 1024.0) : "-");
    if (!partition.compatible()) {
      text +=
          painted(Look::kBad,
                  "  incompatible: tf-dude " +
                      (partition.program.empty() ? "of an unknown version" : partition.program) +
                      " speaks protocol " + to_string(partition.protocol) +
                      ", this program speaks " + to_string(kProtocolVersion) + "\n");
      continue;
    }
    if (!partition.complete && partition.reachable) {
      text += painted(Look::kWarning, "  has not sent all of its frames\n");
    }
    if (partition.clock == ClockKind::kExternal) text += "  external clock\n";
    if (partition.in_memory) text += "  lookups read its memory\n";
    if (!partition.why_not_in_memory.empty() && partition.reachable) {
      text += "  lookups ask it over DDS: " + partition.why_not_in_memory + "\n";
    }
    if (partition.reachable) continue;
    const char* why = partition.silent    ? "  silent since "
                      : partition.stopped ? "  stopped since "
                                          : "  lost since ";
    text += painted(partition.stopped ? Look::kWarning : Look::kBad,
                    why + to_string(partition.since) + "\n");
  }
  return text;
}

namespace {

struct Partitions final : PlainCommand {
  using PlainCommand::PlainCommand;

  int ask(Client& client, const Common& common) const override {
    client.find_memory();
    const auto partitions = client.partitions();
    if (!partitions) return report(partitions.error(), common);
    const int status = check_partitions(client, common, !partitions->empty());
    if (status != kDone) return status;
    auto json = nlohmann::json::array();
    std::vector<PartitionRow> rows;
    for (const PartitionInfo& partition : *partitions) {
      json.push_back(partition_json(partition));
      rows.push_back({partition, std::nullopt});
      if (!partition.reachable) continue;
      json.back()["in_memory"] = partition.in_memory;
      if (!partition.why_not_in_memory.empty()) {
        json.back()["why_not_in_memory"] = partition.why_not_in_memory;
      }
      if (!partition.complete) continue;  // whoever sends no frames may not answer, either
      if (const auto histories = client.histories(partition.name)) {
        const HistorySum sum = sum_of(*histories);
        json.back()["moving"] = sum.edges;
        json.back()["samples"] = sum.samples;
        json.back()["history_bytes"] = sum.bytes;
        rows.back().history = sum;
      }
    }
    return answer(common, {{"partitions", json}}, partition_table(rows));
  }
};

}  // namespace

void add_partitions(Commands& commands) {
  commands.add<Partitions>("partitions", "list all partitions", "partitions");
}

}  // namespace tfdude::cli
