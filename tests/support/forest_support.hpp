#pragma once

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "tree/forest.hpp"

namespace tfdude::testing {

/// "ok" or the name of the error, so that a failed check prints both sides.
template <class T>
[[nodiscard]] std::string outcome(const Result<T>& result) {
  return result ? "ok" : std::string(to_string(result.error().code));
}

/// `metres` ahead, known exactly: along one line edges simply add up.
[[nodiscard]] inline Transform along_x(double metres) {
  return {Pose::trusted(Eigen::Quaterniond::Identity(), {metres, 0, 0}), Covariance()};
}

/// The x of a lookup's answer; NaN, which equals nothing, on an error.
template <class Answer>
[[nodiscard]] double x_of(const Result<Answer>& X) {
  return X ? X->pose.translation().x() : std::numeric_limits<double>::quiet_NaN();
}

[[nodiscard]] inline std::vector<std::string> ids_of(const std::vector<FrameInfo>& frames) {
  std::vector<std::string> ids;
  ids.reserve(frames.size());
  for (const FrameInfo& frame : frames) ids.push_back(frame.id);
  return ids;
}

[[nodiscard]] inline std::vector<std::string> sorted(std::vector<std::string> ids) {
  std::sort(ids.begin(), ids.end());
  return ids;
}

/// "id < parent, owner, attached" in one comparable text.
[[nodiscard]] inline std::string describe(const FrameInfo& frame) {
  return frame.id + " < " + frame.parent + ", owner " + std::to_string(frame.owner) +
         (frame.attached ? ", attached" : "");
}

/// The value of one segment, as its owner gives it.
[[nodiscard]] inline Result<Transform> lookup_segment(const Forest& forest, const std::string& from,
                                                      const std::string& to) {
  return forest.lookup_segments({{from, to}}).map([](const SegmentValues& found) {
    return found.values.at(0);
  });
}

}  // namespace tfdude::testing
