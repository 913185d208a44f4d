#include "render.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "tfdude/base/id.hpp"

#include "format.hpp"
#include "table.hpp"
#include "terminal.hpp"

namespace tfdude::cli {
namespace {

using Children = std::map<std::string, std::vector<const Frame*>>;

// A frame to draw, and the prefixes of its line and of its children's lines.
struct Line {
  const Frame* frame;
  std::string before;
  std::string before_children;
};

std::string label(const Frame& frame, const std::vector<std::string>& unreachable) {
  const bool lost = std::count(unreachable.begin(), unreachable.end(), frame.partition) > 0;
  std::string text = frame.id + "  " +
                     (lost ? painted(Look::kBad, "[" + frame.partition + ", unreachable]")
                           : painted_by_name(frame.partition, "[" + frame.partition + "]"));
  if (!frame.parent.empty() && !frame.attached) {
    text += painted(Look::kWarning, "  (waits for '" + frame.parent + "')");
  }
  return text + "\n";
}

}  // namespace

std::string draw_tree(const std::vector<Frame>& frames,
                      const std::vector<std::string>& unreachable) {
  Children children;
  std::vector<Line> to_draw;  // a stack: the next frame is the last one
  for (const Frame& frame : frames) {
    if (frame.attached) {
      children[frame.parent].push_back(&frame);
    } else {
      to_draw.push_back({&frame, "", ""});
    }
  }
  std::reverse(to_draw.begin(), to_draw.end());
  std::string text;
  while (!to_draw.empty()) {
    const Line line = std::move(to_draw.back());
    to_draw.pop_back();
    text += line.before + label(*line.frame, unreachable);
    const auto found = children.find(line.frame->id);
    if (found == children.end()) continue;
    const auto& below = found->second;
    for (auto child = below.rbegin(); child != below.rend(); ++child) {
      const bool last = child == below.rbegin();
      to_draw.push_back({*child, line.before_children + (last ? "└─ " : "├─ "),
                         line.before_children + (last ? "   " : "│  ")});
    }
  }
  return text;
}

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
    if (partition.clock == ClockKind::kExternal) text += "  external clock\n";
    if (partition.reachable) continue;
    text += painted(partition.stopped ? Look::kWarning : Look::kBad,
                    (partition.stopped ? "  stopped since " : "  lost since ") +
                        to_string(partition.since) + "\n");
  }
  return text;
}

std::string rows_text(const Eigen::MatrixXd& matrix) {
  std::string text;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
      text += format(" % .5e", matrix(row, column));
    }
    text += "\n";
  }
  return text;
}

std::string matrix_table(const Matrix6d& sigma, const AngleUnit& angles) {
  Twist scale = Twist::Ones();
  scale.tail<3>().setConstant(angles.per_radian);
  std::string text;
  for (const char* axis : {"x", "y", "z", "rx", "ry", "rz"}) text += format(" %12s", axis);
  return text + "\n" + rows_text(scale.asDiagonal() * sigma * scale.asDiagonal());
}

nlohmann::json matrix_json(const Eigen::MatrixXd& matrix) {
  nlohmann::json rows = nlohmann::json::array();
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    const Eigen::VectorXd values = matrix.row(row);
    rows.push_back(std::vector<double>(values.begin(), values.end()));
  }
  return rows;
}

void add_covariance(nlohmann::json& json, const std::string& key, const Eigen::MatrixXd& sigma,
                    bool complete) {
  json[key] = nullptr;
  json[complete ? key : key + "_of_specified"] = matrix_json(sigma);
}

std::string unspecified_text(const std::vector<std::string>& edges) {
  std::string text = "unspecified";
  for (const std::string& edge : edges) {
    text += (&edge == &edges.front() ? " for " : ", ") + printable(edge);
  }
  return text;
}

namespace {

std::string describe_pose(const Pose& X_AB, const Shown& shown) {
  std::string text;
  if (shown.matrix) {
    const Eigen::Matrix4d matrix = X_AB.matrix();
    for (int row = 0; row < 4; ++row) {
      text += row == 0 ? "matrix     " : "           ";
      for (int column = 0; column < 4; ++column) {
        text += format(" % .9f", matrix(row, column));
      }
      text += "\n";
    }
    return text;
  }
  const Eigen::Vector3d t = X_AB.translation();
  const Eigen::Vector4d q = X_AB.rotation().coeffs();
  const Eigen::Vector3d rpy = to_rpy(X_AB.rotation());
  text = format("translation  %.6f  %.6f  %.6f  m\n", t.x(), t.y(), t.z());
  text += format("quaternion   %.6f  %.6f  %.6f  %.6f  (x y z w)\n", q[0], q[1], q[2], q[3]);
  return text + "rpy          " + angles_text(rpy.x(), rpy.y(), rpy.z(), shown.angles) + "\n";
}

}  // namespace

std::string describe(const Transform& X_AB, const Shown& shown,
                     const std::vector<std::string>& unspecified) {
  std::string text = describe_pose(X_AB.pose, shown);
  const auto s = X_AB.covariance.of_specified().stddev();
  const bool complete = X_AB.covariance.complete();
  if (!complete) text += "std dev      " + unspecified_text(unspecified) + "\n";
  const std::string deviations =
      format(complete ? "std dev      %.6f  %.6f  %.6f  m" : "  of others  %.6f  %.6f  %.6f  m",
             s[0], s[1], s[2]);
  const std::string angles = angles_text(s[3], s[4], s[5], shown.angles);
  const bool fits = deviations.size() + 3 + angles.size() <= 80;
  text += deviations + (fits ? "   " : "\n             ") + angles + "\n";
  if (!shown.covariance) return text;
  text += std::string("covariance   ") +
          (complete ? "(translation first, of the right perturbation; m, "
                    : "of the others (translation first, right perturbation; m, ") +
          shown.angles.name + ")\n";
  return text + matrix_table(X_AB.covariance.of_specified().matrix(), shown.angles);
}

nlohmann::json lookup_json(const std::string& a, const std::string& b, const Transform& X_AB,
                           const std::vector<std::string>& partitions) {
  const Eigen::Vector3d t = X_AB.pose.translation();
  const Eigen::Quaterniond q = X_AB.pose.rotation();
  nlohmann::json json = {{"from", a},
                         {"to", b},
                         {"translation", {t.x(), t.y(), t.z()}},
                         {"rotation", {q.x(), q.y(), q.z(), q.w()}},
                         {"partitions", partitions}};
  add_covariance(json, "covariance", X_AB.covariance.of_specified().matrix(),
                 X_AB.covariance.complete());
  return json;
}

nlohmann::json frame_json(const Frame& frame) {
  return {{"id", frame.id},
          {"parent", frame.parent.empty() ? nlohmann::json() : nlohmann::json(frame.parent)},
          {"partition", frame.partition},
          {"attached", frame.attached}};
}

nlohmann::json partition_json(const PartitionInfo& partition) {
  nlohmann::json json{{"name", partition.name},
                      {"host", partition.host},
                      {"pid", partition.pid},
                      {"frames", partition.frames},
                      {"reachable", partition.reachable}};
  if (!partition.program.empty()) json["program"] = partition.program;
  json["protocol"] = to_string(partition.protocol);
  if (partition.clock) json["clock"] = to_string(*partition.clock);
  if (!partition.compatible()) {
    json["reason"] = "incompatible";
  } else if (!partition.reachable) {
    json["reason"] = partition.stopped ? "stopped" : "lost";
  }
  return json;
}

nlohmann::json change_json(const Change& change) {
  nlohmann::json json{{"event", to_string(change.kind)},
                      {"time", static_cast<double>(change.time.time_since_epoch().count()) * 1e-9},
                      {"message", change.message}};
  const std::pair<const char*, const std::string&> names[] = {{"partition", change.partition},
                                                              {"frame", change.frame},
                                                              {"parent", change.parent},
                                                              {"rival", change.rival},
                                                              {"joint", change.joint}};
  for (const auto& [key, name] : names) {
    if (!name.empty()) json[key] = name;
  }
  if (change.kind == ChangeKind::kPartitionDown) {
    json["reason"] = change.stopped ? "stopped" : "lost";
  }
  return json;
}

// Zero has no sign, for programs that compare texts.
void without_signed_zeros(nlohmann::json& json) {
  if (json.is_number_float() && json.get<double>() == 0) json = 0.0;
  if (!json.is_structured()) return;
  for (nlohmann::json& part : json) without_signed_zeros(part);
}

std::string dump(nlohmann::json json) {
  without_signed_zeros(json);
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace tfdude::cli
