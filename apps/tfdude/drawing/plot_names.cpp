#include "plot_names.hpp"

#include <algorithm>

namespace tfdude::cli {
namespace {

constexpr double kLabelWidth = 100;

// A place for a name beside its dot.
struct Spot {
  double right;  // offset from the dot, in units of its radius plus a margin
  double down;
  double before;  // fraction of the name's width that lies left of this place
  const char* look;
};
constexpr Spot kSpots[] = {{1, 0, 0, "name"},           {-1, 0, 1, "name end"},
                           {0, -1, 0.5, "name middle"}, {0, 1, 0.5, "name middle"},
                           {0.8, -0.9, 0, "name"},      {0.8, 0.9, 0, "name"},
                           {-0.8, -0.9, 1, "name end"}, {-0.8, 0.9, 1, "name end"}};

// Places names beside their dots where there is room: never over another name or dot, and over the
// path only if the caller allows it.
class Names {
 public:
  Names(const Box& panel, const std::vector<Dot>& dots) : panel_(panel), dots_(dots) {
    taken_.reserve(2 * dots.size());
    for (const auto& [at, radius] : dots) {
      taken_.push_back({at.x - radius, at.y - radius, 2 * radius, 2 * radius});
    }
  }

  // @return whether there was room
  bool place(Svg& svg, std::size_t index, const std::string& frame, bool over_path) {
    constexpr double kHeight = 14;
    constexpr double kBetween = 5;
    const std::string name = elide(frame, kLabelSize, kLabelWidth);
    const double width = text_width(name, kLabelSize);
    const auto [at, radius] = dots_[index];
    for (const Spot& spot : kSpots) {
      const double x = at.x + spot.right * (radius + 3);
      const double y = at.y + spot.down * (radius + 3 + kHeight / 2);
      const Box box{x - spot.before * width, y - kHeight / 2, width, kHeight};
      if (!is_free(box) || (!over_path && is_on_path(box))) continue;
      taken_.push_back({box.x - kBetween, box.y, width + 2 * kBetween, kHeight});
      svg.text({x, y + 4}, name, spot.look);
      return true;
    }
    return false;
  }

 private:
  [[nodiscard]] bool is_free(const Box& box) const {
    return panel_.contains(box) &&
           std::none_of(taken_.begin(), taken_.end(),
                        [&](const Box& other) { return other.overlaps(box); });
  }
  [[nodiscard]] bool is_on_path(const Box& box) const {
    for (std::size_t i = 0; i + 1 < dots_.size(); ++i) {
      if (box.crosses(dots_[i].at, dots_[i + 1].at)) return true;
    }
    return false;
  }

  const Box& panel_;
  const std::vector<Dot>& dots_;
  std::vector<Box> taken_;
};

}  // namespace

void draw_names(Svg& svg, const Box& panel, const std::vector<std::string>& frames,
                const std::vector<Dot>& dots) {
  Names names(panel, dots);
  // The ends come first, and may cover the path.
  const std::size_t last = frames.size() - 1;
  for (const std::size_t end : {last, std::size_t{0}}) {
    if (!names.place(svg, end, frames[end], false)) (void)names.place(svg, end, frames[end], true);
    if (last == 0) return;
  }
  for (std::size_t i = 1; i < last; ++i) (void)names.place(svg, i, frames[i], false);
}

}  // namespace tfdude::cli
