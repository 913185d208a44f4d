#include <algorithm>
#include <map>

#include "tfdude/base/id.hpp"

#include "description/file_edges.hpp"
#include "description/file_text.hpp"

namespace tfdude {
namespace {

// The covariance of cam_from_world that pycolmap returns, (rotation, translation), as that of the
// right perturbation of the camera in the world. Its rotation is changed as Ceres does it, by half
// of an angle vector δ: R' = Exp(2δ) R, t' = t + τ. So ξ = -(τ + t × 2δ, 2δ).
Result<Covariance> camera_covariance(const std::array<double, 36>& given, const Pose& X_CW) {
  const Matrix6d sigma =
      Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(given.data());
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = 2 * skew(X_CW.translation());
  J.topRightCorner<3, 3>().setIdentity();
  J.bottomLeftCorner<3, 3>() = 2 * Eigen::Matrix3d::Identity();
  const Matrix6d symmetric = (sigma + sigma.transpose()) / 2;
  if (!(symmetric - sigma).isZero(1e-6 * sigma.cwiseAbs().maxCoeff())) {
    return fail(Errc::kInvalidInput, "covariance is not symmetric");
  }
  return Covariance::from_matrix(J * symmetric * J.transpose());
}

struct GivenCovariance {
  std::array<double, 36> numbers{};
  int line = 0;
};
using GivenCovariances = std::map<std::size_t, GivenCovariance>;  // by IMAGE_ID

Result<GivenCovariances> covariances_of(const std::string& text, const std::string& name) {
  GivenCovariances given;
  TextLines lines(text);
  while (lines.next()) {
    const auto words = words_of(lines.line());
    if (words.empty() || words[0][0] == '#') continue;
    constexpr std::size_t kWords = 37;
    // numpy.savetxt() writes all numbers alike.
    const auto id = number_of(words[0]);
    const auto numbers = numbers_of<kWords - 1>(words, 1);
    const bool whole =
        id && *id >= 0 && *id < 1e15 && *id == static_cast<double>(static_cast<std::size_t>(*id));
    if (words.size() != kWords || !whole || !numbers) {
      return file_error(Errc::kConfig, name, lines.number(), "is not an IMAGE_ID and 36 numbers");
    }
    const auto image = static_cast<std::size_t>(*id);
    if (!given.emplace(image, GivenCovariance{*numbers, lines.number()}).second) {
      return file_error(Errc::kInvalidInput, name, lines.number(),
                        "image " + std::to_string(image) + " is given twice");
    }
  }
  return given;
}

// Which other file of a model a line is from, as far as its words tell; null: none.
const char* other_file(const std::vector<std::string_view>& words) {
  // FRAME_ID RIG_ID QW QX QY QZ TX TY TZ NUM_DATA_IDS, then SENSOR_TYPE SENSOR_ID DATA_ID each
  const bool has_sensor =
      words.size() >= 13 && (words[10] == "CAMERA" || words[10] == "IMU") && count_of(words[1]);
  if (has_sensor) return "frames.txt";
  // POINT3D_ID X Y Z R G B ERROR, then IMAGE_ID POINT2D_IDX each
  constexpr std::size_t kBrightest = 255;
  for (const std::size_t i : {4U, 5U, 6U}) {
    const auto colour = count_of(words[i]);
    if (!colour || *colour > kBrightest) return nullptr;
  }
  const bool has_track =
      words.size() % 2 == 0 && std::all_of(words.begin() + 8, words.end(), count_of);
  return has_track ? "points3D.txt" : nullptr;
}

// The pose of an image. @param words  of its line, at least ten
Result<Pose> camera_pose(const std::vector<std::string_view>& words,
                         const std::array<double, 7>& numbers) {
  const auto& [qw, qx, qy, qz, tx, ty, tz] = numbers;
  const auto X_CW = Pose::create({qw, qx, qy, qz}, {tx, ty, tz});
  const char* other = other_file(words);
  const bool is_other = other != nullptr && (!X_CW || std::string_view(other) == "frames.txt");
  if (!is_other) return X_CW;
  return fail(Errc::kInvalidInput,
              std::string("is a line of ") + other + ": only images.txt is read");
}

// X Y POINT3D_ID each; the id of a point that was not triangulated is -1, or the largest number.
bool are_points(const std::vector<std::string_view>& words) {
  if (words.size() % 3 != 0) return false;
  for (std::size_t i = 0; i < words.size(); i += 3) {
    const bool has_id = count_of(words[i + 2]) || words[i + 2] == "-1";
    if (!has_id || !number_of(words[i]) || !number_of(words[i + 1])) return false;
  }
  return true;
}

}  // namespace

// For each image two lines: IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, the pose of the world in
// the camera; and its points, which may be none.
FileEdges read_colmap(const std::string& text, const std::string& name,
                      const std::string& covariances, const std::string& covariances_name) {
  auto given = covariances_of(covariances, covariances_name);
  if (!given) return tl::unexpected(std::move(given.error()));
  std::vector<FileEdge> edges;
  std::map<std::size_t, int> images;  // the line of each
  TextLines lines(text);
  while (lines.next()) {
    const auto words = words_of(lines.line());
    if (words.empty() || words[0][0] == '#') continue;
    const int line = lines.number();
    const auto image = count_of(words[0]);
    const auto numbers = numbers_of<7>(words, 1);
    if (words.size() < 10 || !image || !numbers) {
      return file_error(Errc::kConfig, name, line,
                        "is not IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME");
    }
    const auto X_CW = camera_pose(words, *numbers);
    if (!X_CW) return file_error(Errc::kInvalidInput, name, line, X_CW.error().message);
    if (!count_of(words[8])) {
      return file_error(Errc::kConfig, name, line,
                        "CAMERA_ID is " + quote(words[8]) + ", which is not a whole number");
    }
    if (const auto [other, fresh] = images.emplace(*image, line); !fresh) {
      return file_error(Errc::kInvalidInput, name, line,
                        "image " + std::to_string(*image) + " is given twice, before in line " +
                            std::to_string(other->second));
    }
    FileEdge edge;
    edge.line = line;
    // A name may have spaces.
    const auto begin = static_cast<std::size_t>(words[9].data() - lines.line().data());
    const std::string_view last = words.back();
    const auto end = static_cast<std::size_t>(last.data() + last.size() - lines.line().data());
    edge.frame.id = lines.line().substr(begin, end - begin);
    edge.frame.parent = "world";
    edge.frame.X_PC.pose = X_CW->inverse();
    if (const auto found = given->find(*image); found != given->end()) {
      const auto sigma = camera_covariance(found->second.numbers, *X_CW);
      if (!sigma) {
        return file_error(Errc::kInvalidInput, covariances_name, found->second.line,
                          "image " + std::to_string(*image) + ": " + sigma.error().message);
      }
      edge.frame.X_PC.covariance = *sigma;
      // Bundle adjustment correlates all images, and this does not say how.
      edge.frame.correlation.unknown = true;
      given->erase(found);
    }
    edges.push_back(std::move(edge));
    if (lines.next() && !are_points(words_of(lines.line()))) {
      return file_error(Errc::kConfig, name, lines.number(),
                        "is not a line of points, X Y POINT3D_ID each; without points it is empty");
    }
  }
  if (given->empty()) return edges;
  return file_error(Errc::kInvalidInput, covariances_name, given->begin()->second.line,
                    "there is no image " + std::to_string(given->begin()->first));
}

}  // namespace tfdude
