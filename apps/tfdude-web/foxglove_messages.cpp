#include "foxglove_messages.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <Eigen/Eigenvalues>

#include "../rendering/json.hpp"
#include "types/ros_tf.hpp"

namespace tfdude::web::foxglove {
namespace {

using nlohmann::json;

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr double kDeviations = 3;
constexpr double kLeastDiameter = 1e-6;  // [m]

json time_json(Time time) {
  const std::int64_t ns = std::max<std::int64_t>(nanoseconds(time), 0);
  return {{"sec", ns / kSecond}, {"nsec", ns % kSecond}};
}

json vector_json(const Eigen::Vector3d& v) { return {{"x", v.x()}, {"y", v.y()}, {"z", v.z()}}; }

json quaternion_json(const Eigen::Quaterniond& q) {
  return {{"x", q.x()}, {"y", q.y()}, {"z", q.z()}, {"w", q.w()}};
}

// A sphere that is stretched to the ellipsoid.
json sphere_json(const Transform& X_RF) {
  const Eigen::Matrix3d R = X_RF.pose.rotation().toRotationMatrix();
  const Matrix6d sigma = X_RF.covariance.of_specified().matrix();
  const Eigen::Matrix3d of_position = R * sigma.topLeftCorner<3, 3>() * R.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(of_position);
  Eigen::Matrix3d axes = solver.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) *= -1;
  const Eigen::Vector3d diameters =
      (2 * kDeviations * solver.eigenvalues().cwiseMax(0).cwiseSqrt()).cwiseMax(kLeastDiameter);
  return {{"pose",
           {{"position", vector_json(X_RF.pose.translation())},
            {"orientation", quaternion_json(Eigen::Quaterniond(axes))}}},
          {"size", vector_json(diameters)},
          {"color", {{"r", 0.49}, {"g", 0.61}, {"b", 1.0}, {"a", 0.35}}}};
}

json object(const char* title, json properties) {
  return {{"title", title}, {"type", "object"}, {"properties", std::move(properties)}};
}

json array_of(json items) { return {{"type", "array"}, {"items", std::move(items)}}; }

json numbers(const char* title, const std::vector<std::string>& names) {
  json properties = json::object();
  for (const std::string& name : names) properties[name] = {{"type", "number"}};
  return object(title, std::move(properties));
}

json schema_json(const std::string& schema) {
  const json text{{"type", "string"}};
  const json integer{{"type", "integer"}};
  const json time = object("time", {{"sec", integer}, {"nsec", integer}});
  const json vector = numbers("foxglove.Vector3", {"x", "y", "z"});
  const json quaternion = numbers("foxglove.Quaternion", {"x", "y", "z", "w"});
  if (schema == kFrameTransforms) {
    return object(
        kFrameTransforms,
        {{"transforms", array_of(object("foxglove.FrameTransform", {{"timestamp", time},
                                                                    {"parent_frame_id", text},
                                                                    {"child_frame_id", text},
                                                                    {"translation", vector},
                                                                    {"rotation", quaternion}}))}});
  }
  if (schema == kLog) {
    return object(kLog, {{"timestamp", time},
                         {"level", integer},
                         {"message", text},
                         {"name", text},
                         {"file", text},
                         {"line", integer}});
  }
  if (schema == kPairSchema) {
    return object(kPairSchema, {{"from", text},
                                {"to", text},
                                {"translation", array_of({{"type", "number"}})},
                                {"rotation", array_of({{"type", "number"}})},
                                {"covariance", array_of(array_of({{"type", "number"}}))}});
  }
  const json pose = object("foxglove.Pose", {{"position", vector}, {"orientation", quaternion}});
  const json sphere = object("foxglove.SpherePrimitive",
                             {{"pose", pose},
                              {"size", vector},
                              {"color", numbers("foxglove.Color", {"r", "g", "b", "a"})}});
  const json entity = object("foxglove.SceneEntity", {{"timestamp", time},
                                                      {"frame_id", text},
                                                      {"id", text},
                                                      {"lifetime", time},
                                                      {"frame_locked", {{"type", "boolean"}}},
                                                      {"spheres", array_of(sphere)}});
  const json deletion = object("foxglove.SceneEntityDeletion",
                               {{"timestamp", time}, {"type", integer}, {"id", text}});
  return object(kSceneUpdate, {{"deletions", array_of(deletion)}, {"entities", array_of(entity)}});
}

}  // namespace

std::string frame_transforms(const std::vector<Edge>& edges) {
  json transforms = json::array();
  for (const Edge& edge : edges) {
    transforms.push_back({{"timestamp", time_json(edge.stamp)},
                          {"parent_frame_id", edge.parent},
                          {"child_frame_id", edge.child},
                          {"translation", vector_json(edge.X_PC.translation())},
                          {"rotation", quaternion_json(edge.X_PC.rotation())}});
  }
  return cli::dump({{"transforms", std::move(transforms)}});
}

std::string tf_message(const std::vector<Edge>& edges) {
  std::string message;
  ros::TfEncoder encoder(message);
  for (const Edge& edge : edges) encoder.add(edge.parent, edge.child, edge.X_PC, edge.stamp);
  encoder.finish();
  return message;
}

std::string scene_update(const std::vector<Ellipsoid>& ellipsoids, Time now, bool all) {
  json entities = json::array();
  for (const Ellipsoid& ellipsoid : ellipsoids) {
    json entity{
        {"timestamp", time_json(now)}, {"frame_id", ellipsoid.root},
        {"id", ellipsoid.frame},       {"lifetime", time_json(Time{})},
        {"frame_locked", true},        {"spheres", json::array({sphere_json(ellipsoid.X_RF)})}};
    for (const char* other :
         {"metadata", "arrows", "cubes", "cylinders", "lines", "triangles", "texts", "models"}) {
      entity[other] = json::array();
    }
    entities.push_back(std::move(entity));
  }
  json deletions = json::array();
  constexpr int kAll = 1;
  if (all) deletions.push_back({{"timestamp", time_json(now)}, {"type", kAll}, {"id", ""}});
  return cli::dump({{"deletions", std::move(deletions)}, {"entities", std::move(entities)}});
}

std::string log_message(Time time, bool warning, const std::string& name,
                        const std::string& message) {
  constexpr int kInfo = 2;
  constexpr int kWarning = 3;
  return cli::dump({{"timestamp", time_json(time)},
                    {"level", warning ? kWarning : kInfo},
                    {"message", message},
                    {"name", name},
                    {"file", ""},
                    {"line", 0}});
}

std::string message_data(std::uint32_t subscription, Time time, std::string_view data) {
  std::string bytes(1 + 4 + 8, '\1');
  const auto ns = static_cast<std::uint64_t>(std::max<std::int64_t>(nanoseconds(time), 0));
  std::memcpy(bytes.data() + 1, &subscription, sizeof(subscription));
  std::memcpy(bytes.data() + 5, &ns, sizeof(ns));
  return bytes.append(data);
}

json channel(std::uint32_t id, const std::string& topic, const std::string& schema) {
  const bool ros = schema == kTfMessage;
  return {{"id", id},
          {"topic", topic},
          {"encoding", ros ? "cdr" : "json"},
          {"schemaName", schema},
          {"schema", ros ? std::string(ros::kTfDefinition) : schema_json(schema).dump()},
          {"schemaEncoding", ros ? "ros2msg" : "jsonschema"}};
}

}  // namespace tfdude::web::foxglove
