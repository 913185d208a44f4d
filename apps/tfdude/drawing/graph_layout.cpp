#include "graph_layout.hpp"

#include <algorithm>
#include <map>
#include <string_view>

namespace tfdude::cli {
namespace {

using Place = GraphRow::Place;
using Boxes = std::vector<GraphBox>;

// Builds the boxes from the roots on.
class Builder {
 public:
  Builder(const std::vector<Frame>& frames, const GraphScope& scope) : scope_(scope) {
    for (const Frame& frame : frames) {
      if (frame.attached) children_[frame.parent].push_back(&frame);
      const bool root = scope.root.empty() ? !frame.attached : frame.id == scope.root;
      if (root) open_.push_back({&frame, std::nullopt, 0});
    }
  }

  Boxes build() {
    for (std::size_t next = 0; next < open_.size(); ++next) add_box(open_[next]);
    return std::move(boxes_);
  }

 private:
  // A frame with which a box begins.
  struct Start {
    const Frame* frame;
    std::optional<std::size_t> above;
    std::size_t depth;  // of the frame
  };

  [[nodiscard]] const std::vector<const Frame*>& below(const Frame& frame) const {
    static const std::vector<const Frame*> kNone;
    const auto found = children_.find(frame.id);
    return found != children_.end() ? found->second : kNone;
  }

  [[nodiscard]] std::size_t count_below(const Frame& frame) const {
    std::vector<const Frame*> open{&frame};
    for (std::size_t i = 0; i < open.size(); ++i) {
      const auto& more = below(*open[i]);
      open.insert(open.end(), more.begin(), more.end());
    }
    return open.size() - 1;
  }

  void add_box(Start start) {
    const std::size_t index = boxes_.size();
    GraphBox box;
    box.above = start.above;
    if (start.above) {
      box.level = boxes_[*start.above].level + 1;
      boxes_[*start.above].below.push_back(index);
    }
    box.rows.push_back({start.frame, Place::kFirst});
    const Frame* frame = start.frame;
    std::size_t depth = start.depth;
    while (frame != nullptr) {
      if (scope_.depth && depth == *scope_.depth) {
        box.folded = count_below(*frame);
        break;
      }
      ++depth;
      frame = continue_chain(*frame, box, index, depth);
    }
    boxes_.push_back(std::move(box));
  }

  // Adds what is below a frame. @return the next frame of the chain; null: it ends
  const Frame* continue_chain(const Frame& frame, GraphBox& box, std::size_t index,
                              std::size_t depth) {
    std::vector<const Frame*> inner;
    std::vector<const Frame*> leaves;
    for (const Frame* child : below(frame)) {
      (below(*child).empty() ? leaves : inner).push_back(child);
    }
    if (inner.empty() && leaves.size() == 1) std::swap(inner, leaves);
    const auto level = static_cast<std::size_t>(
        std::count_if(box.rows.begin(), box.rows.end(),
                      [](const GraphRow& row) { return row.place != Place::kLeaf; }));
    for (const Frame* leaf : leaves) box.rows.push_back({leaf, Place::kLeaf, level});
    if (inner.size() == 1) {
      box.rows.push_back({inner.front(), Place::kNext, level});
      return inner.front();
    }
    for (const Frame* child : inner) open_.push_back({child, index, depth});
    return nullptr;
  }

  const GraphScope& scope_;
  std::map<std::string_view, std::vector<const Frame*>> children_;
  std::vector<Start> open_;
  Boxes boxes_;
};

// The size of the picture, about.
struct Size {
  double width = 0;
  double height = 0;
};

// Graphviz moves boxes up and down to straighten the arrows between the columns.
constexpr double kLooseness = 1.1;

Size size_of(const Boxes& boxes, const GraphMeasures& measures) {
  std::map<std::size_t, Size> columns;  // by the levels
  for (const GraphBox& box : boxes) {
    Size& column = columns[box.level];
    const auto rows = static_cast<double>(box.rows.size() + (box.folded > 0 ? 1 : 0));
    column.height += rows * measures.row_height + measures.between;
    for (const GraphRow& row : box.rows) {
      const auto levels = static_cast<double>(std::min(row.level, kMostIndents));
      column.width =
          std::max(column.width, measures.row_width(*row.frame) + levels * measures.indent);
    }
  }
  Size size;
  for (const auto& [level, column] : columns) {
    size.width += column.width + measures.columns;
    size.height = std::max(size.height, kLooseness * column.height);
  }
  return size;
}

bool fits(const Boxes& boxes, const GraphMeasures& measures) {
  const Size size = size_of(boxes, measures);
  return size.width <= kScreenWidth && size.height <= kScreenHeight;
}

std::size_t levels_of(const Boxes& boxes) {
  std::size_t levels = 0;
  for (const GraphBox& box : boxes) levels = std::max(levels, box.level + 1);
  return levels;
}

// Leaves out the boxes of the last level, which are the last ones.
void fold_level(Boxes& boxes) {
  const std::size_t last = levels_of(boxes) - 1;
  while (boxes.back().level == last) {
    const GraphBox& box = boxes.back();
    GraphBox& above = boxes[*box.above];
    above.folded += box.rows.size() + box.folded;
    above.below.pop_back();
    boxes.pop_back();
  }
}

// Leaves out rows at the end of the highest boxes, so that those of one column fit.
void fold_rows(Boxes& boxes, const GraphMeasures& measures) {
  const auto room_for = [&](std::size_t most) {
    double height = 0;
    for (const GraphBox& box : boxes) {
      const auto rows = static_cast<double>(std::min(box.rows.size(), most) + 1);
      height += rows * measures.row_height + measures.between;
    }
    return kLooseness * height <= kScreenHeight;
  };
  constexpr std::size_t kMany = 1000;  // more than a screen has
  std::size_t most = 1;
  while (most < kMany && room_for(most + 1)) ++most;
  for (GraphBox& box : boxes) {
    if (box.rows.size() <= most) continue;
    box.folded += box.rows.size() - most;
    box.rows.erase(box.rows.begin() + static_cast<std::ptrdiff_t>(most), box.rows.end());
  }
}

}  // namespace

const Frame& GraphBox::last() const {
  const auto found = std::find_if(rows.rbegin(), rows.rend(),
                                  [](const GraphRow& row) { return row.place != Place::kLeaf; });
  return *found->frame;
}

std::vector<GraphBox> boxes_of(const std::vector<Frame>& frames, const GraphScope& scope,
                               const GraphMeasures& measures) {
  Boxes boxes = Builder(frames, scope).build();
  if (scope.depth) return boxes;
  while (levels_of(boxes) > 1 && !fits(boxes, measures)) fold_level(boxes);
  if (!fits(boxes, measures)) fold_rows(boxes, measures);
  return boxes;
}

}  // namespace tfdude::cli
