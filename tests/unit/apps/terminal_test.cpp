// Colours, and texts that have them.

#include "rendering/terminal.hpp"

#include <cstdlib>
#include <fcntl.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "tfdude/commands/joints.hpp"

#include "rendering/screen.hpp"
#include "rendering/table.hpp"
#include "support/catch.hpp"

namespace tfdude::cli {
namespace {

constexpr Terminal kColours{true, 80};

// A terminal of 123 columns.
class Pty {
 public:
  Pty() : master_(posix_openpt(O_RDWR | O_NOCTTY)) {
    if (grantpt(master_) != 0 || unlockpt(master_) != 0) return;
    file_ = open(ptsname(master_), O_RDWR | O_NOCTTY);
    winsize size{40, 123, 0, 0};
    ioctl(file_, TIOCSWINSZ, &size);
  }
  ~Pty() {
    close(file_);
    close(master_);
  }
  Pty(const Pty&) = delete;
  Pty& operator=(const Pty&) = delete;

  [[nodiscard]] int file() const { return file_; }

 private:
  int master_;
  int file_ = -1;
};

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
  CHECK(name_width({name}, 18) == 18);
  CHECK(name_width({"a"}, 18) == 18);
  for (const auto& [columns, width] :
       {std::pair<std::size_t, std::size_t>(100, 38), {400, 60}, {60, 13}, {20, 8}}) {
    terminal().columns = columns;
    CHECK(name_width({"a", name}, 18) == width);
    CHECK(length_of(cell(name, width)) == width);
  }
  terminal().columns = 100;
  CHECK(name_width({name}, 18, 12) == 30);
  CHECK(name_width({name}, 12, 18) == 20);
  terminal() = {};
}

TEST_CASE("terminal: what is no terminal has no width, and one has that of COLUMNS or its own") {
  CHECK(terminal_of(-1).columns == kUnlimited);
  terminal().columns = kUnlimited;
  const std::string name(255, 'n');
  CHECK(cell(name, name_width({name}, 18, 15)) == name);
  JointInfo joint;
  joint.name = joint.frame = name;
  joint.mimic = Mimic{name, 1, 0};
  const std::string table = joint_table({joint}, kRadian);
  CHECK(table.find(name + " " + name + " ") != std::string::npos);
  CHECK(table.find("mimics " + name + " (x 1 + 0)\n") != std::string::npos);
  terminal() = {};

  const Pty pty;
  REQUIRE(pty.file() >= 0);
  unsetenv("COLUMNS");
  CHECK(terminal_of(pty.file()).columns == 123);
  setenv("COLUMNS", "200", 1);
  CHECK(terminal_of(pty.file()).columns == 200);
  setenv("COLUMNS", "wide", 1);
  CHECK(terminal_of(pty.file()).columns == 123);
  unsetenv("COLUMNS");
}

}  // namespace tfdude::cli
