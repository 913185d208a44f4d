#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/types/frame.hpp"

// Calibrations, launch files and pose graphs of other programs. docs/files.md says which frames
// each of them has, and what its numbers mean.
namespace tfdude {

enum class FrameFormat : std::uint8_t {
  kKalibr,     ///< a camera chain of Kalibr: T_cam_imu or T_imu_cam, and T_cn_cnm1
  kEyeOnHand,  ///< easy_handeye and easy_handeye2, a camera on the robot's hand
  kEyeOnBase,  ///< the same, a camera beside the robot
  kRos1,       ///< static_transform_publisher in a launch file of ROS 1
  kRos2,       ///< the same in a launch file of ROS 2, in XML, Python or YAML
  kOpenCv,     ///< R and T of OpenCV's stereoCalibrate()
  kColmap,     ///< images.txt of COLMAP
  kG2o,        ///< a pose graph of g2o
};

/// "kalibr", "eye-on-hand", "eye-on-base", "ros1", "ros2", "opencv", "colmap" or "g2o".
[[nodiscard]] TFDUDE_EXPORT const char* to_string(FrameFormat format);
/// The inverse of to_string(). @return kInvalidInput, with all names
[[nodiscard]] TFDUDE_EXPORT Result<FrameFormat> frame_format_named(std::string_view name);

/// A file of another program, and how its frames are called here.
struct FrameFile {
  std::string file;
  std::optional<FrameFormat> format{};  ///< absent: told from the content
  /// Prepended to all names, except those that `names` gives.
  std::string prefix{};
  /// By the name in the file. Formats without names have those of docs/files.md.
  std::map<std::string, std::string> names{};
  double unit = 1;                ///< the length of 1 in the file [m]
  StatedCovariance covariance{};  ///< of edges for which the file has none
  /// Of COLMAP, a text file: for each image a line of its IMAGE_ID and the 36 numbers that
  /// pycolmap's get_cam_cov_from_world() returns. Empty: none.
  std::string covariances{};
};

/// Reads the edges of a file, a parent before its children. The parents of the topmost ones are
/// frames that the file places nowhere, such as Kalibr's imu0. At most 64 MiB are read.
///
/// The poses of a g2o graph must be its solution. Their joint covariance is that of the graph,
/// linearized there, as an optimizer's marginals: a part that is each edge's own, and sources that
/// they share (Correlation).
/// @return kConfig naming the file and line: a missing file, not of that format; kInvalidInput
///   naming the file, line and key: a value that is none, a name that is given twice or not valid,
///   a cycle; of a graph: not solved, or not determined; kTooMuch: a graph of too many poses.
[[nodiscard]] TFDUDE_EXPORT Result<std::vector<FrameSpec>> load_frames(const FrameFile& file);

/// As load_frames(), from text. `file.file` stands for the file in messages, and
/// `file.covariances` is the text of that file.
[[nodiscard]] TFDUDE_EXPORT Result<std::vector<FrameSpec>> parse_frames(const std::string& text,
                                                                        const FrameFile& file);

/// The text of a file of a format, as its programs write it. Numbers have all digits. Covariances
/// are written only by g2o, which needs one for each edge.
/// @param frames  the edges; what load_frames() returns is written as it was
/// @return kInvalidInput naming the frame: the format cannot say it.
[[nodiscard]] TFDUDE_EXPORT Result<std::string> write_frames(const std::vector<FrameSpec>& frames,
                                                             FrameFormat format);

}  // namespace tfdude
