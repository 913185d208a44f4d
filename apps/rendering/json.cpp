#include "json.hpp"

#include <utility>

#include "tfdude/math/perturbation.hpp"

#include "quantities.hpp"
#include "table.hpp"

namespace tfdude::cli {
namespace {

using nlohmann::json;

// Zero has no sign, for programs that compare texts.
void remove_signs_of_zeros(json& part) {
  if (part.is_number_float() && part.get<double>() == 0) part = 0.0;
  if (!part.is_structured()) return;
  for (json& one : part) remove_signs_of_zeros(one);
}

}  // namespace

std::string dump(json object) {
  remove_signs_of_zeros(object);
  return object.dump(-1, ' ', false, json::error_handler_t::replace);
}

json numbers_json(const Eigen::VectorXd& numbers) {
  return std::vector<double>(numbers.begin(), numbers.end());
}

json matrix_json(const Eigen::MatrixXd& matrix) {
  json rows = json::array();
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    rows.push_back(numbers_json(matrix.row(row)));
  return rows;
}

json ns_json(const std::optional<Time>& time) { return time ? json(nanoseconds(*time)) : json(); }

void add_covariance(json& object, const std::string& key, const Eigen::MatrixXd& sigma,
                    bool complete) {
  object[key] = nullptr;
  object[complete ? key : key + "_of_specified"] = matrix_json(sigma);
}

void add_covariance(json& object, const StatedCovariance& covariance) {
  add_covariance(object, "covariance", covariance.of_specified().matrix(), covariance.complete());
}

void add_stamp(json& object, const std::optional<Time>& stamp) {
  object["stamp"] = nullptr;
  if (stamp) object["stamp"] = static_cast<double>(nanoseconds(*stamp)) * 1e-9;
  object["stamp_ns"] = ns_json(stamp);
}

json lookup_json(const std::string& a, const std::string& b, const Transform& X_AB,
                 const std::vector<std::string>& partitions) {
  json object{{"from", a},
              {"to", b},
              {"translation", numbers_json(X_AB.pose.translation())},
              {"rotation", numbers_json(X_AB.pose.rotation().coeffs())},
              {"partitions", partitions}};
  add_covariance(object, X_AB.covariance);
  object["covariance_axes"] = b;
  return object;
}

json lookup_json(const std::string& a, const std::string& b, const StampedTransform& X_AB,
                 const std::vector<PathSegment>& path) {
  json object = lookup_json(a, b, X_AB, names_of(path, &PathSegment::partition));
  add_stamp(object, X_AB.stamp);
  object["basis"] = basis_json(X_AB.basis);
  return object;
}

json geodetic_json(const GeodeticPose& seen) {
  json object{{"latitude", seen.place.latitude},
              {"longitude", seen.place.longitude},
              {"altitude", seen.place.altitude},
              {"rotation_enu", numbers_json(seen.X_NB.pose.rotation().coeffs())},
              {"utm",
               {{"zone", zone_text(seen.utm)},
                {"easting", seen.utm.easting},
                {"northing", seen.utm.northing},
                {"convergence", seen.utm.convergence},
                {"scale", seen.utm.scale}}},
              {"stddev_enu", nullptr}};
  if (!seen.X_NB.covariance.complete()) return object;
  const auto deviations = stddev_in_parent(seen.X_NB);
  object["stddev_enu"] = {deviations[0], deviations[1], deviations[2]};
  return object;
}

json basis_json(const Basis& basis) {
  return {{"order", static_cast<int>(basis.order)},
          {"bound", basis.bound},
          {"sources", basis.sources},
          {"unspecified", basis.unspecified}};
}

json frame_json(const Frame& frame) {
  return {{"id", frame.id},
          {"parent", frame.parent.empty() ? json() : json(frame.parent)},
          {"partition", frame.partition},
          {"attached", frame.attached}};
}

json partition_json(const PartitionInfo& partition) {
  json object{{"name", partition.name},
              {"host", nullptr},
              {"pid", nullptr},
              {"frames", partition.frames},
              {"reachable", partition.reachable}};
  if (!partition.host.empty()) {
    object["host"] = partition.host;
    object["pid"] = partition.pid;
  } else if (!partition.reachable) {
    object["frames"] = nullptr;  // it was lost before this process started
  }
  if (!partition.program.empty()) object["program"] = partition.program;
  object["protocol"] = to_string(partition.protocol);
  if (partition.clock) object["clock"] = to_string(*partition.clock);
  if (!partition.complete) object["complete"] = false;
  if (!partition.compatible()) {
    object["reason"] = "incompatible";
  } else if (!partition.reachable) {
    object["reason"] = partition.silent ? "silent" : partition.stopped ? "stopped" : "lost";
  }
  return object;
}

json joint_json(const JointInfo& joint) {
  json object{{"name", joint.name},
              {"frame", joint.frame},
              {"type", to_string(joint.type)},
              {"position", joint.position},
              {"variance", or_null(joint.variance)},
              {"measured", joint.measured},
              {"outside", joint.outside},
              {"refused", joint.refused},
              {"limits", nullptr},
              {"mimic", nullptr}};
  if (joint.limits) object["limits"] = {joint.limits->lower, joint.limits->upper};
  if (joint.mimic) {
    object["mimic"] = {{"joint", joint.mimic->joint},
                       {"multiplier", joint.mimic->multiplier},
                       {"offset", joint.mimic->offset}};
  }
  return object;
}

json history_json(const HistoryInfo& history, std::optional<Time> now) {
  json object{{"id", history.id},
              {"moving", history.dynamic()},
              {"samples", history.samples},
              {"bytes", history.bytes},
              {"span_limit", seconds(history.span_limit)},
              {"count_limit", history.count_limit},
              {"rate", rate_of(history)},
              {"mean_gap", seconds(history.mean_gap)},
              {"max_gap", seconds(history.max_gap)},
              {"jitter", seconds(history.jitter)},
              {"refused_old", history.refused_old},
              {"refused_equal", history.refused_equal},
              {"refused_ahead", history.refused_ahead}};
  if (!history.newest) return object;
  object["oldest_ns"] = nanoseconds(*history.oldest);
  object["newest_ns"] = nanoseconds(*history.newest);
  object["span"] = seconds(*history.newest - *history.oldest);
  object["age"] = nullptr;
  if (now) object["age"] = seconds(*now - *history.newest);
  return object;
}

json change_json(const Change& change) {
  json object{{"event", to_string(change.kind)},
              {"time", seconds(change.time.time_since_epoch())},
              {"message", change.message}};
  const std::pair<const char*, const std::string&> names[] = {{"partition", change.partition},
                                                              {"frame", change.frame},
                                                              {"parent", change.parent},
                                                              {"rival", change.rival},
                                                              {"joint", change.joint}};
  for (const auto& [key, name] : names) {
    if (!name.empty()) object[key] = name;
  }
  if (change.kind == ChangeKind::kPartitionDown) {
    object["reason"] = change.stopped ? "stopped" : "lost";
  }
  return object;
}

}  // namespace tfdude::cli
