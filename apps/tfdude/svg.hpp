#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tfdude::cli {

/// In pixels, y downwards.
struct Point {
  double x = 0;
  double y = 0;
};

struct Box {
  double x = 0;
  double y = 0;
  double width = 0;
  double height = 0;

  [[nodiscard]] double right() const { return x + width; }
  [[nodiscard]] double bottom() const { return y + height; }
  [[nodiscard]] bool contains(const Box& other) const;
  [[nodiscard]] bool overlaps(const Box& other) const;
  /// Whether any of the line from a to b is within.
  [[nodiscard]] bool crosses(Point a, Point b) const;
};

/// Valid UTF-8 without control characters, where what may not be in XML none the less is U+FFFD.
[[nodiscard]] std::string xml_allowed(std::string_view text);

/// The same where what has a meaning in XML is written as an entity.
[[nodiscard]] std::string xml_escape(std::string_view text);

/// How wide a line of text may get in a usual sans-serif font of a size; no font is asked.
[[nodiscard]] double text_width(std::string_view text, double size);

/// The text, or its ends with "…" between them where it would be wider.
[[nodiscard]] std::string elide(std::string_view text, double size, double width);

/// Writes a picture as SVG. How a thing looks is said by names of classes of the style sheet.
class Svg {
 public:
  /// @param title  for those who cannot see it
  /// @param style  CSS
  Svg(double width, double height, std::string_view title, std::string_view style);

  void rect(const Box& box, std::string_view look);
  void line(Point a, Point b, std::string_view look);
  void circle(Point center, double radius, std::string_view look);
  /// Through all points, also where they are all the same.
  void curve(const std::vector<Point>& points, bool closed, std::string_view look);
  /// A stroke without length for each point: round where the style gives it round caps.
  void dots(const std::vector<Point>& points, std::string_view look);
  void text(Point at, std::string_view text, std::string_view look);
  /// The same, written upwards.
  void text_up(Point at, std::string_view text, std::string_view look);

  [[nodiscard]] std::string finish() const { return out_ + "</svg>\n"; }

 private:
  void path(const std::string& data, std::string_view look);

  std::string out_;
};

}  // namespace tfdude::cli
