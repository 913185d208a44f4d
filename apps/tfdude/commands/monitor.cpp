#include "monitor.hpp"

#include <cmath>
#include <string_view>

#include "../../rendering/format.hpp"
#include "../../rendering/json.hpp"
#include "../../rendering/quantities.hpp"
#include "../../rendering/screen.hpp"
#include "../../rendering/table.hpp"
#include "../../rendering/terminal.hpp"
#include "../../rendering/text.hpp"
#include "../commands.hpp"

namespace tfdude::cli {
namespace {

double milliseconds(std::chrono::nanoseconds duration) { return seconds(duration) * 1e3; }

std::string count_cell(std::uint64_t count, std::size_t columns) {
  return number(static_cast<double>(count), 0, columns);
}

// The factor by which the edge's variance should be larger.
double factor_of(const EdgeConsistency& edge) {
  return edge.sum.expected > 0 ? edge.sum.squares / edge.sum.expected : 0.0;
}

// The difference of the squares from their expected value, in standard deviations.
double deviation_of(const EdgeConsistency& edge) {
  if (!(edge.sum.variance > 0)) return 0.0;
  return (edge.sum.squares - edge.sum.expected) / std::sqrt(edge.sum.variance);
}

// If the covariances are right, one verdict in a hundred is not "agrees".
const char* verdict_of(const EdgeConsistency& edge) {
  constexpr double kBeyondChance = 2.576;
  const double deviation = deviation_of(edge);
  if (deviation > kBeyondChance) return "too small";
  return deviation < -kBeyondChance ? "too large" : "agrees";
}

nlohmann::json consistency_json(const EdgeConsistency& edge) {
  return {{"id", edge.id},
          {"observations", edge.observations},
          {"refused", edge.refused},
          {"variance_factor", factor_of(edge)},
          {"deviations", deviation_of(edge)},
          {"verdict", verdict_of(edge)}};
}

}  // namespace

std::string monitor_table(const std::string& partition, const std::vector<HistoryInfo>& histories,
                          std::optional<Time> now) {
  const HistorySum sum = sum_of(histories);
  std::string text = "partition " + shortened(partition, room(24)) +
                     format(": %zu samples of %zu edges, %.1f KiB\n", sum.samples, sum.edges,
                            static_cast<double>(sum.bytes) / 1024.0);
  if (histories.empty()) return text;
  const std::size_t columns = name_width(names_of(histories, &HistoryInfo::id), 22);
  const auto row = [&](const std::string& edge, const std::string& rate, const std::string& age,
                       const std::string& jitter, const std::string& gap,
                       const std::string& rejected) {
    return "  " + cell(edge, columns) +
           format(" %10s %10s %11s %10s %9s\n", rate.c_str(), age.c_str(), jitter.c_str(),
                  gap.c_str(), rejected.c_str());
  };
  text += painted(Look::kHeader,
                  row("edge", "rate [Hz]", "age [ms]", "jitter [ms]", "gap [ms]", "rejected"));
  for (const HistoryInfo& history : histories) {
    text += row(history.id, number(rate_of(history), 1, 10),
                history.newest && now ? number(milliseconds(*now - *history.newest), 1, 10) : "-",
                number(milliseconds(history.jitter), 3, 11),
                number(milliseconds(history.max_gap), 3, 10), count_cell(rejected_of(history), 9));
  }
  return text;
}

std::string consistency_table(const std::vector<EdgeConsistency>& edges) {
  if (edges.empty()) return "";
  const std::size_t columns = name_width(names_of(edges, &EdgeConsistency::id), 22);
  const auto row = [&](const std::string& edge, const std::string& observed,
                       const std::string& rejected, const std::string& factor,
                       const std::string& deviations, const char* covariance) {
    return "  " + cell(edge, columns) +
           format(" %8s %8s %9s %10s  %s\n", observed.c_str(), rejected.c_str(), factor.c_str(),
                  deviations.c_str(), covariance);
  };
  std::string text = painted(Look::kHeader, row("observed edge", "observed", "rejected", "factor",
                                                "deviations", "covariance"));
  for (const EdgeConsistency& edge : edges) {
    const std::string_view agrees = "agrees";
    const std::string verdict =
        painted(verdict_of(edge) == agrees ? Look::kGood : Look::kWarning, verdict_of(edge));
    text += row(edge.id, count_cell(edge.observations, 8), count_cell(edge.refused, 8),
                number(factor_of(edge), 2, 9), number(deviation_of(edge), 1, 10), verdict.c_str());
  }
  return text;
}

std::string outside_table(const std::vector<JointInfo>& joints, const AngleUnit& angles) {
  std::string text;
  const std::size_t columns = name_width(names_of(joints, &JointInfo::name), 22);
  const auto row = [&](const std::string& joint, const std::string& position, const char* unit,
                       const std::string& applied, const std::string& rejected,
                       const std::string& limits) {
    return "  " + cell(joint, columns) +
           format(" %10s %-4s %10s %10s %s\n", position.c_str(), unit, applied.c_str(),
                  rejected.c_str(), limits.c_str());
  };
  for (const JointInfo& joint : joints) {
    if (joint.outside == 0 && joint.refused == 0) continue;
    if (text.empty()) {
      text = row("joint outside limits", "position", "unit", "applied", "rejected", "limits");
    }
    text +=
        row(joint.name, position_cell(joint, joint.position, angles, 10), unit_of(joint, angles),
            count_cell(joint.outside, 10), count_cell(joint.refused, 10), limits_of(joint, angles));
  }
  return text;
}

namespace {

struct Monitor final : LiveCommand {
  explicit Monitor(CLI::App& app) {
    until_interrupted = true;
    add_rate(app, rate, "output rate [Hz]");
    app.add_flag("--once", once, "print it once");
    explain_angles(app);
  }

  int ask(Client& client, const Common& common) const override {
    Screen screen;
    do {
      const auto partitions = client.partitions();
      if (!partitions) return report_cause(client, partitions.error(), common);
      if (partitions->empty() && once) {
        return report_cause(client, {Errc::kUnknownPartition, "no partition"}, common);
      }
      auto all = nlohmann::json::array();
      std::string text = partitions->empty() ? nobody_answers(common) + "\n" : "";
      for (const PartitionInfo& partition : *partitions) {
        all.push_back(look_at(client, common, partition, text));
      }
      if (common.json) {
        (void)answer(common, {{"partitions", std::move(all)}}, "");
      } else {
        screen.redraw(text);
      }
    } while (!once && !interrupted_within(1.0 / rate));
    return kDone;
  }

  // Adds to the text what it returns as JSON.
  static nlohmann::json look_at(Client& client, const Common& common,
                                const PartitionInfo& partition, std::string& text) {
    const auto histories = client.histories(partition.name);
    nlohmann::json json{{"partition", partition.name}, {"reachable", histories.has_value()}};
    if (!histories) {
      text += "partition " + partition.name + ": " + histories.error().message + "\n";
      return json;
    }
    const auto now = present(client, common, partition);
    const auto list = [](const auto& all, const auto& json_of_one) {
      auto objects = nlohmann::json::array();
      for (const auto& one : all) objects.push_back(json_of_one(one));
      return objects;
    };
    json["edges"] =
        list(*histories, [&](const HistoryInfo& one) { return history_json(one, now); });
    text += monitor_table(partition.name, *histories, now);
    if (const auto observed = client.consistency(partition.name)) {
      json["observed"] = list(*observed, consistency_json);
      text += consistency_table(*observed);
    }
    if (const auto joints = client.joints(partition.name)) {
      json["joints"] = list(*joints, joint_json);
      text += outside_table(*joints, common.angles);
    }
    return json;
  }

  double rate = kRedrawRate;
  bool once = false;
};

}  // namespace

void add_monitor(Commands& commands) {
  commands.add<Monitor>("monitor", "rate, age and jitter of all dynamic edges", "monitor --once");
}

}  // namespace tfdude::cli
