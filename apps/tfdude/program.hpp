#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tfdude/base/result.hpp"

namespace tfdude::cli {

/// Another program, and the Debian package that contains it.
struct Program {
  std::vector<std::string> argv;
  const char* package;
};

/// Runs a program without a shell. It reads and writes files in memory, so neither process waits
/// for a pipe.
/// @return its standard output; kInvalidInput: it cannot be run, has failed or does not end
[[nodiscard]] Result<std::string> run_program(Program program, const std::string& input);

/// An open file, in memory or on disk.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&&) = delete;
  ~Descriptor();

  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] bool write_all(const std::string& text) const;
  [[nodiscard]] std::string read_all() const;

 private:
  int fd_;
};

}  // namespace tfdude::cli
