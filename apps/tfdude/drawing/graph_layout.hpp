#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/types/frame.hpp"

// Which frames a picture of the forest shows, and how they are put together so that it fits a
// screen.
namespace tfdude::cli {

/// A line of a box.
struct GraphRow {
  enum class Place {
    kFirst,  ///< below the last frame of the parent's box, or a root
    kNext,   ///< below the frame of the last row that is no leaf
    kLeaf,   ///< likewise, and nothing is below it
  };
  const Frame* frame;
  Place place = Place::kFirst;
  std::size_t level = 0;  ///< below the first frame of the box
};

/// A chain of frames in one column. Leaves beside the chain stand between its frames.
struct GraphBox {
  std::vector<GraphRow> rows{};
  std::size_t folded = 0;              ///< number of frames below it that are left out
  std::vector<std::size_t> below{};    ///< the boxes below its last frame that is no leaf
  std::optional<std::size_t> above{};  ///< absent: the first frame is a root
  std::size_t level = 0;               ///< number of boxes above it

  /// The frame that the boxes below hang on.
  [[nodiscard]] const Frame& last() const;
};

/// Rows that are deeper in a box are indented as those of this level.
inline constexpr std::size_t kMostIndents = 8;

/// The measures of the picture's texts [pt].
struct GraphMeasures {
  double row_height = 0;
  std::function<double(const Frame&)> row_width;  ///< of a frame's row
  double indent = 0;                              ///< of a row for each level below the first one
  double between = 0;                             ///< two boxes of one column
  double columns = 0;                             ///< the distance of two columns
};

/// A screen of 1,600 x 1,200 pixels, at 96 pixels per inch, without margins [pt].
inline constexpr double kScreenWidth = 1170;
inline constexpr double kScreenHeight = 870;

/// What to draw.
struct GraphScope {
  std::string root{};                ///< this frame and all below it; empty: all frames
  std::optional<std::size_t> depth;  ///< frames more levels below a root are left out; absent: as
                                     ///< many levels as fit a screen
};

/// Puts the frames of a forest into boxes. Boxes come after those above them.
[[nodiscard]] std::vector<GraphBox> boxes_of(const std::vector<Frame>& frames,
                                             const GraphScope& scope,
                                             const GraphMeasures& measures);

}  // namespace tfdude::cli
