#include "description/file_edges.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>

#include <Eigen/SVD>

namespace tfdude {

Result<Pose> rounded_pose(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation) {
  constexpr double kTolerance = 1e-3;
  const auto wrong = fail(Errc::kInvalidInput, "the upper left 3x3 is no rotation");
  if (!rotation.allFinite() || !(rotation.determinant() > 0)) return wrong;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rotation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d nearest = svd.matrixU() * svd.matrixV().transpose();
  if ((rotation - nearest).cwiseAbs().maxCoeff() > kTolerance) return wrong;
  return Pose::create(Eigen::Quaterniond(nearest), translation);
}

std::vector<std::string_view> words_of(std::string_view line) {
  constexpr std::string_view kBlanks = " \t\r";
  std::vector<std::string_view> words;
  for (std::size_t begin = line.find_first_not_of(kBlanks); begin != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBlanks, begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(kBlanks, end);
  }
  return words;
}

std::optional<double> number_of(std::string_view word) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  double number = 0;
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), number);
  const bool whole = code == std::errc() && end == word.data() + word.size();
  return whole && std::isfinite(number) ? std::optional(number) : std::nullopt;
}

std::optional<std::size_t> count_of(std::string_view word) {
  std::size_t count = 0;
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), count);
  const bool whole = code == std::errc() && end == word.data() + word.size();
  return whole ? std::optional(count) : std::nullopt;
}

bool TextLines::next() {
  if (rest_.empty()) return false;
  const std::size_t end = std::min(rest_.find('\n'), rest_.size());
  line_ = rest_.substr(0, end);
  rest_.remove_prefix(std::min(end + 1, rest_.size()));
  ++number_;
  return true;
}

}  // namespace tfdude
