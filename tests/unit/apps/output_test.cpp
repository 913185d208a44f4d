#include "tfdude/output.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <future>
#include <iterator>
#include <string>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "support/catch.hpp"
#include "support/process.hpp"

namespace tfdude::cli {
namespace {

namespace fs = std::filesystem;
using testing::ContainsSubstring;
using testing::TemporaryDirectory;

std::string content(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

mode_t mode_of(const std::string& file) {
  struct stat found {};
  REQUIRE(stat(file.c_str(), &found) == 0);
  return found.st_mode & 07777U;
}

std::string outcome(const Result<void>& result) {
  return result ? "written" : result.error().message;
}

// Makes a file this process's standard output for as long as it exists.
class StandardOutputIn {
 public:
  explicit StandardOutputIn(const std::string& file) : before_(dup(STDOUT_FILENO)) {
    std::fflush(stdout);
    const int out = open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    REQUIRE(out >= 0);
    dup2(out, STDOUT_FILENO);
    close(out);
  }
  ~StandardOutputIn() {
    dup2(before_, STDOUT_FILENO);
    close(before_);
  }
  StandardOutputIn(const StandardOutputIn&) = delete;
  StandardOutputIn& operator=(const StandardOutputIn&) = delete;

 private:
  int before_;
};

}  // namespace

TEST_CASE("output: a file is replaced as a whole and keeps its mode") {
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/camchain.yaml";
  CHECK(outcome(write_file(file, "first")) == "written");
  CHECK(content(file) == "first");
  std::ifstream reader(file, std::ios::binary);
  const mode_t mode = GENERATE(0600U, 0640U, 0755U);
  REQUIRE(chmod(file.c_str(), mode) == 0);
  CHECK(outcome(write_file(file, "second")) == "written");
  CHECK(content(file) == "second");
  CHECK(mode_of(file) == mode);
  // A file that is open stays what it was.
  CHECK(std::string(std::istreambuf_iterator<char>(reader), {}) == "first");
  CHECK(std::distance(fs::directory_iterator(directory.path()), fs::directory_iterator()) == 1);
}

TEST_CASE("output: a link stays a link, and what it names is replaced") {
  const TemporaryDirectory directory;
  const std::string file = directory.write("source.yaml", "before");
  const std::string near = directory.path() + "/near.yaml";
  const std::string link = directory.path() + "/link.yaml";
  fs::create_symlink("source.yaml", near);
  fs::create_symlink(near, link);
  REQUIRE(chmod(file.c_str(), 0640) == 0);
  CHECK(outcome(write_file(link, "after")) == "written");
  CHECK(fs::is_symlink(link));
  CHECK(fs::is_symlink(near));
  CHECK(content(file) == "after");
  CHECK(mode_of(file) == 0640);

  const std::string fresh = directory.path() + "/fresh.yaml";
  fs::create_symlink("not_yet.yaml", fresh);
  CHECK(outcome(write_file(fresh, "new")) == "written");
  CHECK(fs::is_symlink(fresh));
  CHECK(content(directory.path() + "/not_yet.yaml") == "new");

  const std::string loop = directory.path() + "/loop.yaml";
  fs::create_symlink("loop.yaml", loop);
  CHECK_THAT(outcome(write_file(loop, "x")), ContainsSubstring("loop.yaml"));
  CHECK(fs::is_symlink(loop));
}

TEST_CASE("output: a pipe is written to, directly and through a link") {
  const TemporaryDirectory directory;
  const std::string pipe = directory.path() + "/pipe";
  const std::string link = directory.path() + "/link";
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  fs::create_symlink("pipe", link);
  const std::string& file = GENERATE_REF(pipe, link);
  // Longer than a pipe holds.
  const std::string text(200'000, 'x');
  // Both ends: a writer that does not come must not make the test wait for ever.
  const int end = open(pipe.c_str(), O_RDWR | O_CLOEXEC);
  auto written = std::async(std::launch::async, [&] { return outcome(write_file(file, text)); });
  const auto ended = [&] {
    return written.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  };
  std::string got;
  REQUIRE(fcntl(end, F_SETFL, O_NONBLOCK) == 0);
  CHECK(testing::eventually([&] {
    std::array<char, 65536> block{};
    const bool last = ended();
    const ssize_t size = read(end, block.data(), block.size());
    if (size > 0) got.append(block.data(), static_cast<std::size_t>(size));
    return got.size() >= text.size() || (last && size <= 0);
  }));
  CHECK(written.get() == "written");
  CHECK(got == text);
  CHECK(fs::is_fifo(pipe));
  CHECK(fs::is_symlink(link));
  close(end);
}

TEST_CASE("output: what cannot be written to is named and stays what it is") {
  const TemporaryDirectory directory;
  const std::string socket_file = directory.path() + "/socket";
  const int listening = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  REQUIRE(socket_file.size() < sizeof address.sun_path);
  std::copy(socket_file.begin(), socket_file.end(), address.sun_path);
  REQUIRE(bind(listening, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  CHECK_THAT(outcome(write_file(socket_file, "x")),
             ContainsSubstring("cannot write '" + socket_file));
  CHECK(fs::is_socket(socket_file));
  close(listening);

  const std::string folder = directory.path() + "/folder";
  fs::create_directory(folder);
  CHECK_THAT(outcome(write_file(folder, "x")), ContainsSubstring("cannot write '" + folder));
  CHECK(fs::is_directory(folder));
  CHECK_THAT(outcome(write_file(directory.path() + "/none/x", "x")), ContainsSubstring("none/x"));
}

TEST_CASE("output: the file of standard output is continued") {
  const TemporaryDirectory directory;
  const std::string file = directory.write("log", "");
  const std::string other = directory.write("other", "");
  {
    const StandardOutputIn redirected(file);
    CHECK(write(STDOUT_FILENO, "before\n", 7) == 7);
    CHECK(is_standard_output(file));
    CHECK(is_standard_output("/proc/self/fd/1"));
    CHECK_FALSE(is_standard_output(other));
    CHECK_FALSE(is_standard_output(directory.path() + "/none"));
    CHECK(outcome(write_file("/proc/self/fd/1", "text\n")) == "written");
    CHECK(write(STDOUT_FILENO, "after\n", 6) == 6);
  }
  CHECK(content(file) == "before\ntext\nafter\n");
}

}  // namespace tfdude::cli
