#include "svg.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "../../rendering/format.hpp"

namespace tfdude::cli {
namespace {

// A hundredth of a pixel is enough; zeros at the end are dropped.
std::string number(double value) {
  std::string text = format("%.2f", value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

std::string pair(Point point) { return number(point.x) + " " + number(point.y); }

std::string attribute(std::string_view name, std::string_view value) {
  return " " + std::string(name) + "=\"" + xml_escape(value) + "\"";
}

bool begins_code_point(char c) { return (static_cast<std::uint8_t>(c) & 0xC0U) != 0x80U; }

// The width of a character in units of the font's size, rather too large than too small. From about
// U+3000 on, characters may be as wide as Chinese ones.
double advance(char first) {
  const auto byte = static_cast<std::uint8_t>(first);
  if (byte >= 0xE3U) return 1.05;
  if (byte >= 0x80U) return 0.68;
  constexpr std::string_view kNarrow = " !'(),./:;I[]`fijlrt|";
  constexpr std::string_view kWide = "%@MWmw";
  if (kNarrow.find(first) != std::string_view::npos) return 0.36;
  if (kWide.find(first) != std::string_view::npos) return 0.96;
  return first >= 'A' && first <= 'Z' ? 0.76 : 0.6;
}

}  // namespace

bool Box::contains(const Box& other) const {
  return other.x >= x && other.y >= y && other.right() <= right() && other.bottom() <= bottom();
}

bool Box::overlaps(const Box& other) const {
  return other.x < right() && x < other.right() && other.y < bottom() && y < other.bottom();
}

// Clips the line at the two sides of each axis in turn (Liang and Barsky).
bool Box::crosses(Point a, Point b) const {
  double from = 0;
  double to = 1;
  const auto cut = [&](double start, double step, double low, double high) {
    if (step == 0) return start >= low && start <= high;
    const double first = (low - start) / step;
    const double second = (high - start) / step;
    from = std::max(from, std::min(first, second));
    to = std::min(to, std::max(first, second));
    return from <= to;
  };
  return cut(a.x, b.x - a.x, x, right()) && cut(a.y, b.y - a.y, y, bottom());
}

std::string xml_allowed(std::string_view text) {
  std::string out(text);
  for (const char* bad : {"\xEF\xBF\xBE", "\xEF\xBF\xBF"}) {
    for (auto at = out.find(bad); at != std::string::npos; at = out.find(bad, at)) {
      out.replace(at, 3, "\xEF\xBF\xBD");
    }
  }
  return out;
}

std::string xml_escape(std::string_view text) {
  std::string out;
  for (const char c : xml_allowed(text)) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

double text_width(std::string_view text, double size) {
  double width = 0;
  for (const char c : text) width += begins_code_point(c) ? advance(c) : 0.0;
  return width * size;
}

std::string elide(std::string_view text, double size, double width) {
  if (text_width(text, size) <= width) return std::string(text);
  constexpr std::string_view kEllipsis = "…";
  const double half = (width - text_width(kEllipsis, size)) / 2;
  std::size_t head = 0;
  for (std::size_t end = 1; end <= text.size(); ++end) {
    if (end < text.size() && !begins_code_point(text[end])) continue;
    if (text_width(text.substr(0, end), size) > half) break;
    head = end;
  }
  std::size_t tail = text.size();
  for (std::size_t begin = text.size(); begin-- > head;) {
    if (!begins_code_point(text[begin])) continue;
    if (text_width(text.substr(begin), size) > half) break;
    tail = begin;
  }
  return std::string(text.substr(0, head)).append(kEllipsis).append(text.substr(tail));
}

Svg::Svg(double width, double height, std::string_view title, std::string_view style)
    : out_("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n") {
  const std::string size = number(width) + " " + number(height);
  out_ += "<svg xmlns=\"http://www.w3.org/2000/svg\"" + attribute("width", number(width)) +
          attribute("height", number(height)) + attribute("viewBox", "0 0 " + size) + ">\n";
  out_ += "<title>" + xml_escape(title) + "</title>\n";
  out_ += "<style>\n" + std::string(style) + "</style>\n";
}

void Svg::rect(const Box& box, std::string_view look) {
  out_ += "<rect" + attribute("class", look) + attribute("x", number(box.x)) +
          attribute("y", number(box.y)) + attribute("width", number(box.width)) +
          attribute("height", number(box.height)) + "/>\n";
}

void Svg::line(Point a, Point b, std::string_view look) {
  path("M" + pair(a) + "L" + pair(b), look);
}

void Svg::circle(Point center, double radius, std::string_view look) {
  out_ += "<circle" + attribute("class", look) + attribute("cx", number(center.x)) +
          attribute("cy", number(center.y)) + attribute("r", number(radius)) + "/>\n";
}

void Svg::curve(const std::vector<Point>& points, bool closed, std::string_view look) {
  std::string data;
  for (const Point& point : points) data += (data.empty() ? "M" : "L") + pair(point);
  path(data + (closed ? "Z" : ""), look);
}

void Svg::dots(const std::vector<Point>& points, std::string_view look) {
  std::string data;
  for (const Point& point : points) data += "M" + pair(point) + "h0";
  if (!data.empty()) path(data, look);
}

void Svg::text(Point at, std::string_view text, std::string_view look) {
  out_ += "<text" + attribute("class", look) + attribute("x", number(at.x)) +
          attribute("y", number(at.y)) + ">" + xml_escape(text) + "</text>\n";
}

void Svg::text_up(Point at, std::string_view text, std::string_view look) {
  out_ += "<text" + attribute("class", look) +
          attribute("transform", "translate(" + pair(at) + ") rotate(-90)") + ">" +
          xml_escape(text) + "</text>\n";
}

void Svg::path(const std::string& data, std::string_view look) {
  out_ += "<path" + attribute("class", look) + attribute("d", data) + "/>\n";
}

}  // namespace tfdude::cli
