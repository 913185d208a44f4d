#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/base/result.hpp"
#include "tfdude/types/frame.hpp"

// What the readers of each format give, and what they share.
namespace tfdude {

/// An edge of a file, with the names that the file has.
struct FileEdge {
  FrameSpec frame;
  int line = 0;  ///< where it stands; 0: the file as a whole
};
using FileEdges = Result<std::vector<FileEdge>>;

// The readers. `name` stands for the file in messages.
[[nodiscard]] FileEdges read_kalibr(const std::string& text, const std::string& name);
/// @param on_hand  what the caller says of it; kInvalidInput: the file says the contrary
[[nodiscard]] FileEdges read_hand_eye(const std::string& text, const std::string& name,
                                      std::optional<bool> on_hand);
[[nodiscard]] FileEdges read_opencv(const std::string& text, const std::string& name);
[[nodiscard]] FileEdges read_launch(const std::string& text, const std::string& name);
/// @param covariances  as of FrameFile, its text
[[nodiscard]] FileEdges read_colmap(const std::string& text, const std::string& name,
                                    const std::string& covariances,
                                    const std::string& covariances_name);
[[nodiscard]] FileEdges read_g2o(const std::string& text, const std::string& name);
/// What write_frames() writes before the number and the name of a vertex, for read_g2o().
inline constexpr std::string_view kG2oName = "# tfdude frame ";

/// The pose that a rotation matrix of few digits stands for: the nearest rotation, if no entry
/// differs from that by more than 1e-3, as after rounding to three decimals.
/// @return kInvalidInput: no rotation; as Pose::create()
[[nodiscard]] Result<Pose> rounded_pose(const Eigen::Matrix3d& rotation,
                                        const Eigen::Vector3d& translation);

/// The words of a line of text, at blanks.
[[nodiscard]] std::vector<std::string_view> words_of(std::string_view line);
/// A finite number that a word is, as a whole.
[[nodiscard]] std::optional<double> number_of(std::string_view word);
/// A whole number that is not negative.
[[nodiscard]] std::optional<std::size_t> count_of(std::string_view word);
/// The numbers of words from the first one on; absent if one is none.
template <std::size_t N>
[[nodiscard]] std::optional<std::array<double, N>> numbers_of(
    const std::vector<std::string_view>& words, std::size_t first) {
  if (words.size() < first + N) return std::nullopt;
  std::array<double, N> numbers{};
  for (std::size_t i = 0; i < N; ++i) {
    const auto number = number_of(words[first + i]);
    if (!number) return std::nullopt;
    numbers[i] = *number;
  }
  return numbers;
}

/// The lines of a text, with their numbers.
class TextLines {
 public:
  explicit TextLines(std::string_view text) : rest_(text) {}

  /// Goes to the next line, which line() then is, without its end. @return whether there is one
  bool next();
  [[nodiscard]] std::string_view line() const { return line_; }
  [[nodiscard]] int number() const { return number_; }

 private:
  std::string_view rest_;
  std::string_view line_;
  int number_ = 0;
};

}  // namespace tfdude
