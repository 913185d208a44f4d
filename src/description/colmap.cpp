#include <algorithm>
#include <map>

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

}  // namespace

// For each image two lines: IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, the pose of the world in
// the camera; and its points, which may be none.
FileEdges read_colmap(const std::string& text, const std::string& covariances,
                      const std::string& name) {
  const std::string covariances_name = "covariances of " + name;
  auto given = covariances_of(covariances, covariances_name);
  if (!given) return tl::unexpected(std::move(given.error()));
  std::vector<FileEdge> edges;
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
    const auto& [qw, qx, qy, qz, tx, ty, tz] = *numbers;
    const auto X_CW = Pose::create({qw, qx, qy, qz}, {tx, ty, tz});
    if (!X_CW) return file_error(Errc::kInvalidInput, name, line, X_CW.error().message);
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
    if (lines.next() && words_of(lines.line()).size() % 3 != 0) {
      return file_error(Errc::kConfig, name, lines.number(),
                        "is not a line of points, X Y POINT3D_ID each; without points it is empty");
    }
  }
  if (given->empty()) return edges;
  return file_error(Errc::kInvalidInput, covariances_name, given->begin()->second.line,
                    "there is no image " + std::to_string(given->begin()->first));
}

}  // namespace tfdude
