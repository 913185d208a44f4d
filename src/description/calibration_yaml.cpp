// Calibrations in YAML: Kalibr, easy_handeye, OpenCV.

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <utility>

#include "tfdude/base/id.hpp"

#include "description/file_edges.hpp"
#include "description/yaml_fields.hpp"
#include "types/ros_rules.hpp"

namespace tfdude {
namespace {

class CalibrationReader : public YamlFields {
 public:
  using YamlFields::YamlFields;

  [[nodiscard]] FileEdges kalibr(const YAML::Node& root) const;
  [[nodiscard]] FileEdges hand_eye(const YAML::Node& root, std::optional<bool> said) const;
  [[nodiscard]] FileEdges opencv(const YAML::Node& root) const;

 private:
  [[nodiscard]] Result<Pose> matrix(const Field& field, const std::string& what) const;
  [[nodiscard]] Result<Eigen::MatrixXd> opencv_matrix(const Fields& entries, const char* key) const;
  [[nodiscard]] Result<std::string> frame(const Fields& entries, const char* key) const;
  [[nodiscard]] Result<bool> on_hand(const Fields& entries, const YAML::Node& node,
                                     std::optional<bool> expected) const;
  template <std::size_t N>
  [[nodiscard]] Result<std::array<double, N>> parts(const Fields& entries, const YAML::Node& node,
                                                    const std::array<const char*, N>& keys,
                                                    const std::string& what) const;
};

FileEdge edge(std::string child, std::string parent, const Pose& X_PC, int line) {
  FrameSpec frame;
  frame.id = std::move(child);
  frame.parent = std::move(parent);
  frame.X_PC.pose = X_PC;
  return {std::move(frame), line};
}

// A homogeneous matrix: four rows of four numbers, or the 16 numbers in one list.
Result<Pose> CalibrationReader::matrix(const Field& field, const std::string& what) const {
  const YAML::Node& rows = field.value;
  const bool flat = rows.IsSequence() && rows.size() == 16;
  if (!flat && (!rows.IsSequence() || rows.size() != 4)) {
    return error(Errc::kConfig, field.mark, what + " is not a 4x4 matrix");
  }
  Eigen::Matrix4d X;
  for (std::size_t i = 0; i < 16; ++i) {
    const YAML::Node row = flat ? rows : rows[i / 4];
    if (!row.IsSequence() || row.size() != (flat ? 16 : 4)) {
      return error(Errc::kConfig, row.Mark(), what + " is not a 4x4 matrix");
    }
    const auto value = number(row[flat ? i : i % 4], what);
    if (!value) return tl::unexpected(value.error());
    X(static_cast<Eigen::Index>(i / 4), static_cast<Eigen::Index>(i % 4)) = *value;
  }
  if (X.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    return error(Errc::kInvalidInput, field.mark, what + ": the last row is not 0 0 0 1");
  }
  auto pose = rounded_pose(X.topLeftCorner<3, 3>(), X.topRightCorner<3, 1>());
  if (pose) return pose;
  return error(pose.error().code, field.mark, what + ": " + pose.error().message);
}

// The entries cam0, cam1 ... by their numbers.
std::map<std::size_t, std::string> cameras_of(const YAML::Node& root) {
  std::map<std::size_t, std::string> cameras;
  for (const auto& entry : root) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
    const auto number = key.rfind("cam", 0) == 0 ? count_of(std::string_view(key).substr(3))
                                                 : std::optional<std::size_t>();
    if (number) cameras.emplace(*number, key);
  }
  return cameras;
}

// Whether it is the identity, but for the digits that files are given.
bool is_near(const Pose& X) {
  constexpr double kSame = 1e-3;  // [m] and [rad]
  return X.translation().norm() <= kSame && log(X).tail<3>().norm() <= kSame;
}

// T_cam_imu is the pose of the IMU in the camera, T_cn_cnm1 that of the camera before. In chains
// for OpenVINS, T_imu_cam is that of the camera in the IMU.
class KalibrChain {
 public:
  struct Camera {
    std::size_t number = 0;
    std::string name;
    std::optional<Pose> X_CI{};
    std::optional<Pose> X_CB{};
    int line = 0;
  };

  // @return kInvalidInput: it does not fit to the cameras before
  [[nodiscard]] Result<void> add(const Camera& camera) {
    if (camera.X_CB && (!before_ || before_->number + 1 != camera.number)) {
      return fail(Errc::kInvalidInput, "T_cn_cnm1: there is no camera before");
    }
    if (!camera.X_CB) begin(camera);
    if (!camera.X_CI && !camera.X_CB && before_) {
      return fail(Errc::kInvalidInput, "has neither T_cam_imu nor T_cn_cnm1");
    }
    if (camera.X_CB) {
      X_first_ = *camera.X_CB * X_first_;
      if (X_I_) *X_I_ = *camera.X_CB * *X_I_;
    }
    if (camera.X_CI && X_I_ && !is_near(camera.X_CI->inverse() * *X_I_)) {
      return fail(Errc::kInvalidInput,
                  "T_cn_cnm1 contradicts T_cam_imu of " + stated_by_ + " and of " + camera.name);
    }
    place(camera);
    before_ = camera;
    return {};
  }

  [[nodiscard]] std::vector<FileEdge> edges() && { return std::move(edges_); }

 private:
  void begin(const Camera& camera) {
    first_ = camera;
    X_first_ = Pose();
    X_I_.reset();
  }

  void place(const Camera& camera) {
    if (camera.X_CI) {
      // The first of the chain has no pose of its own, but this one tells it.
      if (camera.X_CB && !X_I_) {
        edges_.push_back(edge(first_.name, "imu0", camera.X_CI->inverse() * X_first_, first_.line));
      }
      edges_.push_back(edge(camera.name, "imu0", camera.X_CI->inverse(), camera.line));
      X_I_ = camera.X_CI;
      stated_by_ = camera.name;
    } else if (camera.X_CB) {
      edges_.push_back(edge(camera.name, before_->name, camera.X_CB->inverse(), camera.line));
    }
  }

  std::optional<Camera> before_;
  Camera first_;             // of the cameras that T_cn_cnm1 connects
  Pose X_first_;             // in the newest camera
  std::optional<Pose> X_I_;  // the IMU in the newest camera, if a camera of these states it
  std::string stated_by_;    // the last one that does
  std::vector<FileEdge> edges_;
};

FileEdges CalibrationReader::kalibr(const YAML::Node& root) const {
  const auto entries = fields(root, "the file");
  if (!entries) return tl::unexpected(entries.error());
  KalibrChain chain;
  for (const auto& [number, camera] : cameras_of(root)) {
    const Field& field = entries->find(camera)->second;
    const auto keys = fields(field.value, camera);
    if (!keys) return tl::unexpected(keys.error());
    const auto pose_at = [&](const char* key) -> Result<std::optional<Pose>> {
      const auto found = keys->find(key);
      if (found == keys->end()) return std::nullopt;
      return matrix(found->second, camera + ": " + key).map([](const Pose& X) {
        return std::optional(X);
      });
    };
    auto X_CI = pose_at("T_cam_imu");
    if (!X_CI) return tl::unexpected(X_CI.error());
    const auto X_IC = pose_at("T_imu_cam");
    if (!X_IC) return tl::unexpected(X_IC.error());
    if (*X_IC) {
      if (*X_CI && !is_near(**X_CI * **X_IC)) {
        return error(Errc::kInvalidInput, keys->find("T_imu_cam")->second.mark,
                     camera + ": T_imu_cam contradicts T_cam_imu");
      }
      if (!*X_CI) *X_CI = (*X_IC)->inverse();
    }
    const auto X_CB = pose_at("T_cn_cnm1");
    if (!X_CB) return tl::unexpected(X_CB.error());
    if (auto ok = chain.add({number, camera, *X_CI, *X_CB, field.mark.line + 1}); !ok) {
      const YAML::Mark& mark = *X_CB ? keys->find("T_cn_cnm1")->second.mark : field.mark;
      const std::string& why = ok.error().message;
      return error(ok.error().code, mark, camera + (*X_CB ? ": " : " ") + why);
    }
  }
  return std::move(chain).edges();
}

Result<std::string> CalibrationReader::frame(const Fields& entries, const char* key) const {
  const auto found = entries.find(key);
  if (found == entries.end()) return fail(Errc::kConfig, name() + ": " + key + " is missing");
  const auto said = text(found->second, key);
  if (!said) return said;
  std::string id(ros::without_slashes(*said));
  if (id.empty())
    return error(Errc::kInvalidInput, found->second.mark, std::string(key) + " is empty");
  return id;
}

Result<bool> CalibrationReader::on_hand(const Fields& entries, const YAML::Node& node,
                                        std::optional<bool> expected) const {
  const auto type = entries.find("calibration_type");
  const auto flag = entries.find("eye_on_hand");
  if (type == entries.end() && flag == entries.end()) {
    return error(Errc::kConfig, node.Mark(), "neither eye_on_hand nor calibration_type is given");
  }
  const bool typed = type != entries.end();
  const Field& field = typed ? type->second : flag->second;
  const std::string said = field.value.IsScalar() ? field.value.Scalar() : "";
  for (const auto& [word, is_on_hand] :
       {std::pair("eye_in_hand", true), std::pair("true", true), std::pair("True", true),
        std::pair("eye_on_base", false), std::pair("false", false), std::pair("False", false)}) {
    if (said != word) continue;
    if (is_on_hand == expected.value_or(is_on_hand)) return is_on_hand;
    return error(Errc::kInvalidInput, field.mark,
                 std::string("the format is ") + (is_on_hand ? "eye-on-base" : "eye-on-hand") +
                     ", but the file says that the camera is on the " +
                     (is_on_hand ? "hand" : "base"));
  }
  return error(Errc::kInvalidInput, field.mark,
               typed ? "calibration_type is neither eye_in_hand nor eye_on_base"
                     : "eye_on_hand is neither true nor false");
}

template <std::size_t N>
Result<std::array<double, N>> CalibrationReader::parts(const Fields& entries,
                                                       const YAML::Node& node,
                                                       const std::array<const char*, N>& keys,
                                                       const std::string& what) const {
  std::array<double, N> numbers{};
  for (std::size_t i = 0; i < N; ++i) {
    const auto found = entries.find(keys[i]);
    const std::string part = what + ": " + keys[i];
    if (found == entries.end()) return error(Errc::kConfig, node.Mark(), part + " is missing");
    const auto value = number(found->second.value, part);
    if (!value) return tl::unexpected(value.error());
    numbers[i] = *value;
  }
  return numbers;
}

// The transform is the pose of the tracking system's frame in the robot's hand or base.
FileEdges CalibrationReader::hand_eye(const YAML::Node& root, std::optional<bool> expected) const {
  const auto top = fields(root, "the file");
  if (!top) return tl::unexpected(top.error());
  auto said = *top;  // early versions have the parameters beside the transformation
  if (const auto found = top->find("parameters"); found != top->end()) {
    auto below = fields(found->second.value, "parameters");
    if (!below) return tl::unexpected(std::move(below.error()));
    said = *std::move(below);
  }
  const auto hand = on_hand(said, root, expected);
  if (!hand) return tl::unexpected(hand.error());
  auto parent = frame(said, *hand ? "robot_effector_frame" : "robot_base_frame");
  if (!parent) return tl::unexpected(std::move(parent.error()));
  auto child = frame(said, "tracking_base_frame");
  if (!child) return tl::unexpected(std::move(child.error()));
  const bool second = top->count("transform") > 0;  // of easy_handeye2
  const std::string what = second ? "transform" : "transformation";
  const auto found = top->find(what);
  if (found == top->end()) return fail(Errc::kConfig, name() + ": transformation is missing");
  const YAML::Node& node = found->second.value;
  const auto whole = fields(node, what);
  if (!whole) return tl::unexpected(whole.error());
  auto xyz_of = *whole;
  auto quat_of = *whole;
  if (second) {
    for (auto [key, part] : {std::pair("translation", &xyz_of), std::pair("rotation", &quat_of)}) {
      const auto at = whole->find(key);
      if (at == whole->end()) {
        return error(Errc::kConfig, node.Mark(), what + ": " + key + " is missing");
      }
      auto below = fields(at->second.value, what + ": " + key);
      if (!below) return tl::unexpected(std::move(below.error()));
      *part = *std::move(below);
    }
  }
  constexpr std::array<const char*, 3> kXyz = {"x", "y", "z"};
  constexpr std::array<const char*, 4> kFirst = {"qx", "qy", "qz", "qw"};
  constexpr std::array<const char*, 4> kSecond = {"x", "y", "z", "w"};
  const auto p = parts(xyz_of, node, kXyz, what);
  if (!p) return tl::unexpected(p.error());
  const auto q = parts(quat_of, node, second ? kSecond : kFirst, what);
  if (!q) return tl::unexpected(q.error());
  const auto pose = Pose::create({(*q)[3], (*q)[0], (*q)[1], (*q)[2]}, {(*p)[0], (*p)[1], (*p)[2]});
  if (!pose) return error(pose.error().code, node.Mark(), what + ": " + pose.error().message);
  return std::vector<FileEdge>{
      edge(*std::move(child), *std::move(parent), *pose, node.Mark().line + 1)};
}

Result<Eigen::MatrixXd> CalibrationReader::opencv_matrix(const Fields& entries,
                                                         const char* key) const {
  const auto found = entries.find(key);
  const std::string what = key;
  if (found == entries.end()) return fail(Errc::kConfig, name() + ": " + what + " is missing");
  const YAML::Node& node = found->second.value;
  const auto keys = fields(node, what);
  if (!keys) return tl::unexpected(keys.error());
  constexpr std::array<const char*, 2> kSizes = {"rows", "cols"};
  const auto sizes = parts(*keys, node, kSizes, what);
  if (!sizes) return tl::unexpected(sizes.error());
  for (const double size : *sizes) {
    constexpr double kMost = 9;
    if (size >= 1 && size <= kMost && size == std::floor(size)) continue;
    return error(Errc::kConfig, found->second.mark,
                 what + ": rows and cols are not whole numbers from 1 to 9");
  }
  Eigen::MatrixXd matrix(static_cast<Eigen::Index>((*sizes)[0]),
                         static_cast<Eigen::Index>((*sizes)[1]));
  const auto data = keys->find("data");
  if (data == keys->end() || !data->second.value.IsSequence() ||
      static_cast<Eigen::Index>(data->second.value.size()) != matrix.size()) {
    return error(Errc::kConfig, found->second.mark, what + ": data are not rows x cols numbers");
  }
  for (Eigen::Index i = 0; i < matrix.size(); ++i) {
    const auto value = number(data->second.value[static_cast<std::size_t>(i)], what + ": data");
    if (!value) return tl::unexpected(value.error());
    matrix(i / matrix.cols(), i % matrix.cols()) = *value;
  }
  return matrix;
}

// R and T are the pose of the first camera in the second.
FileEdges CalibrationReader::opencv(const YAML::Node& root) const {
  const auto entries = fields(root, "the file");
  if (!entries) return tl::unexpected(entries.error());
  const auto R = opencv_matrix(*entries, "R");
  if (!R) return tl::unexpected(R.error());
  const auto T = opencv_matrix(*entries, "T");
  if (!T) return tl::unexpected(T.error());
  const auto mark = [&](const char* key) { return entries->find(key)->second.mark; };
  if (R->rows() != 3 || R->cols() != 3) {
    return error(Errc::kInvalidInput, mark("R"), "R is not a 3x3 matrix");
  }
  if (T->size() != 3) return error(Errc::kInvalidInput, mark("T"), "T does not have 3 numbers");
  const auto X_21 = rounded_pose(*R, Eigen::Map<const Eigen::Vector3d>(T->data()));
  if (!X_21) return error(X_21.error().code, mark("R"), "R and T: " + X_21.error().message);
  return std::vector<FileEdge>{edge("right", "left", X_21->inverse(), mark("R").line + 1)};
}

FileEdges read(
    const std::string& text, const std::string& name,
    const std::function<FileEdges(const CalibrationReader&, const YAML::Node&)>& edges_of) {
  if (const auto first = text.find_first_not_of(" \t\r\n");
      first < text.size() && text[first] == '<') {
    return fail(Errc::kConfig, name + ": is XML, which is not read: save it as YAML or JSON");
  }
  // OpenCV writes "%YAML:1.0", which is no directive of YAML; as a comment it keeps the numbers of
  // lines.
  std::string yaml = text;
  if (!yaml.empty() && yaml.front() == '%') yaml.front() = '#';
  const CalibrationReader reader(name);
  FileEdges edges;
  auto ok = reader.read_document(yaml, [&](const YAML::Node& root) -> Result<void> {
    edges = edges_of(reader, root);
    return {};
  });
  if (!ok) return tl::unexpected(std::move(ok.error()));
  return edges;
}

}  // namespace

FileEdges read_kalibr(const std::string& text, const std::string& name) {
  return read(text, name, &CalibrationReader::kalibr);
}

FileEdges read_hand_eye(const std::string& text, const std::string& name,
                        std::optional<bool> on_hand) {
  return read(text, name, [&](const CalibrationReader& reader, const YAML::Node& root) {
    return reader.hand_eye(root, on_hand);
  });
}

FileEdges read_opencv(const std::string& text, const std::string& name) {
  return read(text, name, &CalibrationReader::opencv);
}

}  // namespace tfdude
