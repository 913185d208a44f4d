// Colours, and texts that have them.

#include "tfdude/terminal.hpp"

#include "tfdude/screen.hpp"
#include "tfdude/table.hpp"

#include "support/catch.hpp"

namespace tfdude::cli {
namespace {

constexpr Terminal kColours{true, 80};

}  // namespace

TEST_CASE("terminal: only a terminal with colours gets them") {
  CHECK(painted(Look::kBad, "lost", {}) == "lost");
  CHECK(painted(Look::kBad, "lost", kColours) == "\x1b[31mlost\x1b[0m");
  CHECK(painted(Look::kHeader, "name\n", kColours) == "\x1b[1mname\x1b[0m\n");
  CHECK(painted(Look::kGood, "", kColours).empty());
  CHECK(painted_by_name("arm", "a", kColours) == painted_by_name("arm", "a", kColours));
  CHECK(painted_by_name("arm", "a", kColours) != painted_by_name("base", "a", kColours));
}

TEST_CASE("terminal: colours have no width, and end where a text is cut") {
  const std::string text = "a" + painted(Look::kBad, "bcd", kColours) + "e";
  CHECK(length_of(text) == 5);
  CHECK(first_characters(text, 3) == "a\x1b[31mbc\x1b[0m");
  CHECK(first_characters(text, 4) == "a\x1b[31mbcd\x1b[0m");
  CHECK(first_characters(text, 5) == text);
  CHECK(fitted(text + "\n", 2, 2) == "a\x1b[31mb\x1b[0m\n");
}

TEST_CASE("terminal: columns of names are as wide as the terminal allows") {
  const std::string name(60, 'n');
  CHECK(length_of(cell(name, 18)) == 18);
  for (const auto& [columns, width] :
       {std::pair<std::size_t, std::size_t>(160, 36), {400, 40}, {60, 13}, {20, 8}}) {
    terminal().columns = columns;
    CHECK(length_of(cell(name, 18)) == width);
  }
  terminal() = {};
}

}  // namespace tfdude::cli
