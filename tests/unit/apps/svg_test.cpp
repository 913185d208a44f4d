#include "tfdude/drawing/svg.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "tfdude/base/id.hpp"

#include "support/catch.hpp"
#include "support/random.hpp"

namespace tfdude::cli {
namespace {

using testing::ContainsSubstring;
using testing::Random;

TEST_CASE("text for XML has no markup and no invalid characters") {
  CHECK(xml_escape("a<b> & \"c\" 'd'") == "a&lt;b&gt; &amp; &quot;c&quot; 'd'");
  CHECK(xml_escape("&lt;") == "&amp;lt;");
  CHECK(xml_escape("ä 漢 \xF0\x9F\xA4\x96") == "ä 漢 \xF0\x9F\xA4\x96");
  CHECK(xml_escape("x\xEF\xBF\xBEy\xEF\xBF\xBFz") == "x\xEF\xBF\xBDy\xEF\xBF\xBDz");
}

TEST_CASE("long text keeps its beginning and its end") {
  CHECK(elide("arm_left", 12, 200) == "arm_left");
  const std::string name(200, 'x');
  const std::string cut = elide("first" + name + "last", 12, 120);
  CHECK_THAT(cut,
             ContainsSubstring("first") && ContainsSubstring("…") && ContainsSubstring("last"));
  CHECK(text_width(cut, 12) <= 120);
  CHECK(text_width(cut, 12) > 100);
}

TEST_CASE("text is never cut within a character") {
  std::string name;
  for (int i = 0; i < 30; ++i) name += "aä漢\xF0\x9F\xA4\x96";
  for (int width = 0; width < 300; ++width) {
    const std::string cut = elide(name, 12, width);
    INFO(width << ": " << cut);
    CHECK(check_id(cut, "name"));
    // The ellipsis itself may be too much.
    CHECK(text_width(cut, 12) <= std::max<double>(width, text_width("…", 12)));
  }
}

TEST_CASE("a box knows what it contains and overlaps and what crosses it") {
  const Box box{10, 20, 30, 10};
  CHECK(box.contains({10, 20, 30, 10}));
  CHECK_FALSE(box.contains({10, 20, 31, 10}));
  CHECK(box.overlaps({39, 29, 5, 5}));
  CHECK_FALSE(box.overlaps({40, 20, 5, 5}));
  CHECK(box.crosses({0, 25}, {100, 25}));
  CHECK(box.crosses({15, 25}, {16, 25}));
  CHECK(box.crosses({25, 0}, {25, 100}));
  CHECK_FALSE(box.crosses({0, 25}, {5, 25}));
  CHECK_FALSE(box.crosses({0, 0}, {100, 0}));
  CHECK_FALSE(box.crosses({30, 0}, {60, 30}));
}

TEST_CASE("a line crosses a box if one of its points is inside") {
  Random random(4711);
  INFO("seed " << random.seed());
  const Box box{-1, -1, 2, 2};
  int crossing = 0;
  for (int i = 0; i < 500; ++i) {
    const Point a{random.uniform(-3, 3), random.uniform(-3, 3)};
    const Point b{random.uniform(-3, 3), random.uniform(-3, 3)};
    double nearest = 9;  // to the middle, as the larger of both distances
    for (int k = 0; k <= 2000; ++k) {
      const double t = k / 2000.0;
      nearest = std::min(
          nearest, std::max(std::abs(a.x + t * (b.x - a.x)), std::abs(a.y + t * (b.y - a.y))));
    }
    if (std::abs(nearest - 1) < 0.01) continue;  // too near to tell
    CHECK(box.crosses(a, b) == (nearest < 1));
    crossing += nearest < 1 ? 1 : 0;
  }
  CHECK(crossing > 50);
}

TEST_CASE("a picture has all its elements in order") {
  Svg svg(90, 45.5, "A & B", ".look { fill: none; }\n");
  svg.rect({1, 2, 3.125, 4}, "look");
  svg.line({0, 0}, {1.5, -0.001}, "look");
  svg.circle({7, 8}, 2, "look");
  svg.curve({{0, 0}, {1, 1}, {2, 0}}, true, "look");
  svg.dots({{1, 2}, {3, 4}}, "look");
  svg.dots({}, "look");
  svg.text({5, 6}, "<x>", "look");
  svg.text_up({5, 6}, "y", "look");
  CHECK(svg.finish() ==
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"90\" height=\"45.5\""
        " viewBox=\"0 0 90 45.5\">\n"
        "<title>A &amp; B</title>\n"
        "<style>\n.look { fill: none; }\n</style>\n"
        "<rect class=\"look\" x=\"1\" y=\"2\" width=\"3.12\" height=\"4\"/>\n"
        "<path class=\"look\" d=\"M0 0L1.5 0\"/>\n"
        "<circle class=\"look\" cx=\"7\" cy=\"8\" r=\"2\"/>\n"
        "<path class=\"look\" d=\"M0 0L1 1L2 0Z\"/>\n"
        "<path class=\"look\" d=\"M1 2h0M3 4h0\"/>\n"
        "<text class=\"look\" x=\"5\" y=\"6\">&lt;x&gt;</text>\n"
        "<text class=\"look\" transform=\"translate(5 6) rotate(-90)\">y</text>\n"
        "</svg>\n");
}

}  // namespace
}  // namespace tfdude::cli
