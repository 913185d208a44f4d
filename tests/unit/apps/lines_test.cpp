#include "tfdude/lines.hpp"

#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/process.hpp"

namespace tfdude::cli {
namespace {

using testing::TemporaryDirectory;

std::vector<std::string> all_of(Lines& lines) {
  std::vector<std::string> all;
  while (auto line = lines.next()) all.push_back(*line);
  return all;
}

constexpr std::size_t kLongest = std::size_t{16} << 20U;

}  // namespace

TEST_CASE("lines: a file is read line by line, whether or not the last one has its end") {
  const TemporaryDirectory directory;
  const std::string text = GENERATE(
      "\xef\xbb\xbf"
      "one\n\nthree\n",
      "one\n\nthree");
  Lines lines = Lines::open(directory.write("lines", text), std::nullopt).value();
  CHECK(all_of(lines) == std::vector<std::string>{"one", "", "three"});
  CHECK(lines.number() == 3);
  CHECK(lines.failure().empty());
  CHECK_FALSE(lines.interrupted());
}

TEST_CASE("lines: a line has at most 16 MiB") {
  const TemporaryDirectory directory;
  const std::string longest(kLongest, 'x');
  // With and without an end; what follows is not read.
  const std::string end = GENERATE("", "\n", "\nfourth\n");
  const std::string text = "first\n" + longest + "\n" + longest + "x" + end;
  Lines lines = Lines::open(directory.write("lines", text), std::nullopt).value();
  CHECK(lines.next() == "first");
  CHECK((lines.next() == longest));
  CHECK(lines.failure().empty());
  CHECK_FALSE(lines.next());
  CHECK(lines.failure() == "it is longer than 16 MiB");
  CHECK(lines.number() == 3);
  CHECK_FALSE(lines.next());
}

TEST_CASE("lines: what cannot be read is told") {
  const TemporaryDirectory directory;
  Lines lines = Lines::open(directory.path(), std::nullopt).value();
  CHECK_FALSE(lines.next());
  CHECK(lines.failure() == "cannot be read: Is a directory");
  CHECK(lines.number() == 1);
}

}  // namespace tfdude::cli
