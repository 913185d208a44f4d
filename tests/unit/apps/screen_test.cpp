#include "rendering/screen.hpp"

#include "support/catch.hpp"

namespace tfdude::cli {

TEST_CASE("screen: text that fits is not changed") {
  CHECK(fitted("one\ntwo\n", 2, 3) == "one\ntwo\n");
  CHECK(fitted("", 2, 3).empty());
}

TEST_CASE("screen: long lines are cut by characters and not by bytes") {
  CHECK(fitted("abcdef\nab\n", 5, 4) == "abcd\nab\n");
  CHECK(fitted("äöüß\n", 5, 3) == "äöü\n");
}

TEST_CASE("screen: the last line says how many lines are left out") {
  CHECK(fitted("1\n2\n3\n4\n", 3, 40) == "1\n2\n... and 2 lines more\n");
  CHECK(fitted("1\n2\n", 1, 40) == "... and 2 lines more\n");
}

}  // namespace tfdude::cli
