// Writes edges as files of other programs.

#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include <Eigen/Cholesky>

#include "tfdude/base/id.hpp"
#include "tfdude/base/number.hpp"
#include "tfdude/description/frame_file.hpp"

#include "description/file_edges.hpp"

namespace tfdude {
namespace {

using Frames = std::vector<FrameSpec>;

// Without the sign of zero.
std::string digits(double value) { return number_text(value + 0.0, 17); }

template <class Numbers>
std::string joined(const Numbers& numbers, const char* between) {
  std::string text;
  for (Eigen::Index i = 0; i < numbers.size(); ++i) {
    text += (i == 0 ? "" : between) + digits(numbers[i]);
  }
  return text;
}

std::string xyz_quat(const Pose& X, const char* between) {
  return joined(X.translation(), between) + between + joined(X.rotation().coeffs(), between);
}

tl::unexpected<Error> refused(const FrameSpec& frame, const std::string& why) {
  return fail(Errc::kInvalidInput, "frame " + quote(frame.id) + ": " + why);
}

// In YAML and XML a name may need quotes.
std::string yaml_text(const std::string& name) {
  std::string text = "'";
  for (const char c : name) text += c == '\'' ? std::string("''") : std::string(1, c);
  return text + "'";
}

bool has_blank(const std::string& name) {
  return std::any_of(name.begin(), name.end(),
                     [](unsigned char c) { return std::isspace(c) != 0; });
}

bool is_plain(const std::string& name) {
  return !has_blank(name) && name.find_first_of("\"<&$'") == std::string::npos;
}

// In a launch file: neither an option, nor what the shell or ROS would take for something else.
bool is_launch_argument(const std::string& name) {
  return is_plain(name) && name.front() != '/' && name.front() != '-' &&
         name.find(":=") == std::string::npos && name.find('\\') == std::string::npos;
}

Result<const FrameSpec*> only(const Frames& frames, FrameFormat format) {
  if (frames.size() == 1) return &frames.front();
  return fail(Errc::kInvalidInput, std::string("a file of ") + to_string(format) +
                                       " has one edge, not " + std::to_string(frames.size()));
}

std::string kalibr_matrix(const char* key, const Pose& X) {
  std::string text = std::string("  ") + key + ":\n";
  const Eigen::Matrix4d M = X.matrix();
  for (Eigen::Index row = 0; row < 4; ++row) {
    text += "  - [" + joined(Eigen::Vector4d(M.row(row)), ", ") + "]\n";
  }
  return text;
}

// The cameras in order: each is placed in the IMU, or in the camera before.
Result<std::string> kalibr(const Frames& frames) {
  std::string text;
  const std::string& top = frames.front().parent;
  const bool imu = std::all_of(frames.begin(), frames.end(),
                               [&](const FrameSpec& frame) { return frame.parent == top; });
  if (!imu) text += "cam0:  # " + printable(top) + "\n  cam_overlaps: [1]\n";
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::string number = std::to_string(i + (imu ? 0 : 1));
    text += "cam" + number + ":  # " + printable(frames[i].id) + "\n";
    const Pose X_CP = frames[i].X_PC.pose.inverse();
    if (imu) {
      text += kalibr_matrix("T_cam_imu", X_CP);
      if (i > 0) text += kalibr_matrix("T_cn_cnm1", X_CP * frames[i - 1].X_PC.pose);
    } else if (i == 0 || frames[i].parent == frames[i - 1].id) {
      text += kalibr_matrix("T_cn_cnm1", X_CP);
    } else {
      return refused(frames[i], "a camera chain needs it in " + quote(top) +
                                    ", as the first one, or in " + quote(frames[i - 1].id) +
                                    ", the camera before");
    }
  }
  return text;
}

Result<std::string> hand_eye(const Frames& frames, FrameFormat format) {
  const auto edge = only(frames, format);
  if (!edge) return tl::unexpected(edge.error());
  const bool hand = format == FrameFormat::kEyeOnHand;
  const Pose& X = (**edge).X_PC.pose;
  const Eigen::Vector3d p = X.translation();
  const Eigen::Quaterniond q = X.rotation();
  return std::string("parameters:\n  eye_on_hand: ") + (hand ? "true" : "false") + "\n  " +
         (hand ? "robot_effector_frame: " : "robot_base_frame: ") + yaml_text((**edge).parent) +
         "\n  tracking_base_frame: " + yaml_text((**edge).id) +
         "\ntransformation: {x: " + digits(p.x()) + ", y: " + digits(p.y()) +
         ", z: " + digits(p.z()) + ", qx: " + digits(q.x()) + ", qy: " + digits(q.y()) +
         ", qz: " + digits(q.z()) + ", qw: " + digits(q.w()) + "}\n";
}

Result<std::string> launch(const Frames& frames, bool second) {
  constexpr const char* kFlags[] = {"--x", "--y", "--z", "--qx", "--qy", "--qz", "--qw"};
  std::string text = "<launch>\n";
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const FrameSpec& frame = frames[i];
    for (const std::string& name : {frame.id, frame.parent}) {
      if (is_launch_argument(name)) continue;
      return refused(frame, "a launch file cannot have the name " + quote(name));
    }
    Eigen::Matrix<double, 7, 1> numbers;
    numbers << frame.X_PC.pose.translation(), frame.X_PC.pose.rotation().coeffs();
    text += std::string("  <node pkg=\"tf2_ros\" ") + (second ? "exec" : "type") +
            "=\"static_transform_publisher\" name=\"static_transform_" + std::to_string(i) +
            "\" args=\"";
    for (Eigen::Index k = 0; k < numbers.size(); ++k) {
      if (second) text += std::string(kFlags[k]) + " ";
      text += digits(numbers[k]) + " ";
    }
    text += second ? "--frame-id " + frame.parent + " --child-frame-id " + frame.id
                   : frame.parent + " " + frame.id;
    text += "\"/>\n";
  }
  return text + "</launch>\n";
}

Result<std::string> opencv(const Frames& frames) {
  const auto edge = only(frames, FrameFormat::kOpenCv);
  if (!edge) return tl::unexpected(edge.error());
  const Pose X_21 = (**edge).X_PC.pose.inverse();
  const Eigen::Matrix3d R = X_21.rotation().toRotationMatrix().transpose();  // row by row
  const auto matrix = [](const char* key, int columns, const std::string& data) {
    return std::string(key) + ": !!opencv-matrix\n   rows: 3\n   cols: " + std::to_string(columns) +
           "\n   dt: d\n   data: [ " + data + " ]\n";
  };
  return "%YAML:1.0\n---\n" +
         matrix("R", 3, joined(Eigen::Map<const Eigen::Matrix<double, 9, 1>>(R.data()), ", ")) +
         matrix("T", 1, joined(X_21.translation(), ", "));
}

Result<std::string> colmap(const Frames& frames) {
  std::string text =
      "# Image list with two lines of data per image:\n"
      "#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
      "#   POINTS2D[] as (X, Y, POINT3D_ID)\n";
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const FrameSpec& frame = frames[i];
    if (has_blank(frame.id)) return refused(frame, "images.txt cannot have a name with a space");
    if (frame.id == "world") return refused(frame, "images.txt is read below a frame of this name");
    if (frame.parent != frames.front().parent) {
      return refused(frame, "images.txt needs all frames in " + quote(frames.front().parent));
    }
    const Pose X_CW = frame.X_PC.pose.inverse();
    const Eigen::Quaterniond q = X_CW.rotation();
    text += std::to_string(i + 1) + " " + digits(q.w()) + " " +
            joined(Eigen::Vector3d(q.vec()), " ") + " " + joined(X_CW.translation(), " ") + " 1 " +
            frame.id + "\n\n";
  }
  return text;
}

// The information of g2o's error (translation, vector part of the quaternion) of an edge. The
// vector part is half of the angle vector, to first order.
Result<Matrix6d> g2o_information(const FrameSpec& frame) {
  const Covariance* sigma = frame.X_PC.covariance.if_complete();
  if (sigma == nullptr) return refused(frame, "its covariance is not specified; g2o needs one");
  if (!frame.correlation.empty()) {
    return refused(frame, "its error is correlated with others; edges of g2o are independent");
  }
  Twist scale;
  scale << Eigen::Vector3d::Ones(), Eigen::Vector3d::Constant(0.5);
  const Matrix6d of_g2o = scale.asDiagonal() * sigma->matrix() * scale.asDiagonal();
  const Twist deviations = of_g2o.diagonal().cwiseSqrt();
  const Twist inverse = deviations.cwiseInverse();
  const Eigen::LLT<Matrix6d> llt(inverse.asDiagonal() * of_g2o * inverse.asDiagonal());
  constexpr double kLeast = 1e-6;
  const bool regular = deviations.minCoeff() > 0 && llt.info() == Eigen::Success &&
                       llt.matrixLLT().diagonal().minCoeff() > kLeast;
  if (!regular) return refused(frame, "an axis is known exactly; g2o needs an error on each");
  const Matrix6d solved = llt.solve(Matrix6d(inverse.asDiagonal()));
  const Matrix6d information = inverse.asDiagonal() * solved;
  return Matrix6d((information + information.transpose()) / 2);
}

// Frames whose names are numbers keep them; others get the numbers that are left.
std::map<std::string, std::size_t> vertex_numbers(const std::vector<std::string>& ids) {
  std::map<std::string, std::size_t> numbers;
  std::set<std::size_t> taken;
  for (const std::string& id : ids) {
    constexpr std::size_t kDigits = 9;
    const bool number = id.size() <= kDigits &&
                        id.find_first_not_of("0123456789") == std::string::npos &&
                        (id == "0" || id.front() != '0');
    if (number) taken.insert(numbers[id] = *count_of(id));
  }
  std::size_t next = 0;
  for (const std::string& id : ids) {
    if (numbers.count(id) > 0) continue;
    while (taken.count(next) > 0) ++next;
    numbers[id] = next++;
  }
  return numbers;
}

Result<std::string> g2o(const Frames& frames) {
  std::map<std::string, Pose> poses;  // in their root
  std::vector<std::string> ids;
  std::vector<std::string> roots;
  for (const FrameSpec& frame : frames) {
    if (frame.id == "map") return refused(frame, "g2o files are read below a frame of this name");
    if (poses.emplace(frame.parent, Pose()).second) {
      ids.push_back(frame.parent);
      roots.push_back(frame.parent);
    }
    if (!poses.emplace(frame.id, poses[frame.parent] * frame.X_PC.pose).second) {
      return refused(frame, "stands after a frame below it, or twice");
    }
    ids.push_back(frame.id);
  }
  const auto numbers = vertex_numbers(ids);
  std::string text;
  for (const std::string& id : ids) {
    const std::string number = std::to_string(numbers.at(id));
    if (number != id) text += std::string(kG2oName) + number + " " + id + "\n";
    text += "VERTEX_SE3:QUAT " + number + " " + xyz_quat(poses[id], " ") + "\n";
  }
  for (const std::string& id : roots) text += "FIX " + std::to_string(numbers.at(id)) + "\n";
  for (const FrameSpec& frame : frames) {
    const auto information = g2o_information(frame);
    if (!information) return tl::unexpected(information.error());
    text += "EDGE_SE3:QUAT " + std::to_string(numbers.at(frame.parent)) + " " +
            std::to_string(numbers.at(frame.id)) + " " + xyz_quat(frame.X_PC.pose, " ");
    for (Eigen::Index row = 0; row < 6; ++row) {
      for (Eigen::Index column = row; column < 6; ++column) {
        text += " " + digits((*information)(row, column));
      }
    }
    text += "\n";
  }
  return text;
}

// So that what is written can be read again.
Result<void> check_tree(const Frames& frames) {
  std::unordered_map<std::string_view, const FrameSpec*> known;
  for (const FrameSpec& frame : frames) {
    if (frame.parent.empty()) return refused(frame, "is a root, and has no edge");
    if (!known.emplace(frame.id, &frame).second) return refused(frame, "is given twice");
  }
  std::unordered_set<std::string_view> placed;
  for (const FrameSpec& frame : frames) {
    std::unordered_set<std::string_view> chain;
    for (auto at = known.find(frame.id); at != known.end(); at = known.find(at->second->parent)) {
      if (placed.count(at->first) > 0) break;
      if (!chain.insert(at->first).second) return refused(*at->second, "is below itself");
    }
    placed.merge(chain);
  }
  return {};
}

}  // namespace

Result<std::string> write_frames(const std::vector<FrameSpec>& frames, FrameFormat format) {
  if (frames.empty()) return fail(Errc::kInvalidInput, "there are no edges to write");
  if (auto ok = check_tree(frames); !ok) return tl::unexpected(std::move(ok.error()));
  switch (format) {
    case FrameFormat::kKalibr:
      return kalibr(frames);
    case FrameFormat::kEyeOnHand:
    case FrameFormat::kEyeOnBase:
      return hand_eye(frames, format);
    case FrameFormat::kRos1:
    case FrameFormat::kRos2:
      return launch(frames, format == FrameFormat::kRos2);
    case FrameFormat::kOpenCv:
      return opencv(frames);
    case FrameFormat::kColmap:
      return colmap(frames);
    case FrameFormat::kG2o:
      return g2o(frames);
  }
  return fail(Errc::kInvalidInput, "unknown format");
}

}  // namespace tfdude
