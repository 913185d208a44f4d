#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tfdude::cli {

/// A position [px]; y points down.
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
  /// Whether any part of the line from a to b lies within.
  [[nodiscard]] bool crosses(Point a, Point b) const;
};

/// Replaces characters that XML forbids by U+FFFD.
/// @param text  valid UTF-8 without control characters
[[nodiscard]] std::string xml_allowed(std::string_view text);

/// As xml_allowed(), and characters with a meaning in XML become entities.
[[nodiscard]] std::string xml_escape(std::string_view text);

/// The width that a line of text may need in a usual sans-serif font of a size [px]. This is an
/// estimate: no font is read.
[[nodiscard]] double text_width(std::string_view text, double size);

/// The text; if it is wider than `width`, its start and its end with "…" between them.
[[nodiscard]] std::string elide(std::string_view text, double size, double width);

/// Writes a picture as SVG. The parameter `look` has the names of classes in the style sheet.
class Svg {
 public:
  /// @param title  for readers who cannot see the picture
  /// @param style  CSS
  Svg(double width, double height, std::string_view title, std::string_view style);

  void rect(const Box& box, std::string_view look);
  void line(Point a, Point b, std::string_view look);
  void circle(Point center, double radius, std::string_view look);
  /// A line through all points, drawn even if all of them are the same.
  void curve(const std::vector<Point>& points, bool closed, std::string_view look);
  /// A stroke without length for each point: round if the style gives it round caps.
  void dots(const std::vector<Point>& points, std::string_view look);
  void text(Point at, std::string_view text, std::string_view look);
  /// As text(), turned to read upwards.
  void text_up(Point at, std::string_view text, std::string_view look);

  [[nodiscard]] std::string finish() const { return out_ + "</svg>\n"; }

 private:
  void path(const std::string& data, std::string_view look);

  std::string out_;
};

}  // namespace tfdude::cli
