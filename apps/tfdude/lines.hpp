#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "tfdude/base/result.hpp"

#include "program.hpp"

namespace tfdude::cli {

/// The lines of a file or of standard input, until its end or an interrupt (stop_signals(), which
/// the process blocks). A pipe may get its writer later. No line is longer than 16 MiB, which is
/// also what is kept of a file without lines.
class Lines {
 public:
  /// @param file  "-": standard input
  /// @param pace  lines per second; absent: as fast as they come
  /// @return kConfig: the file cannot be opened.
  [[nodiscard]] static Result<Lines> open(const std::string& file, std::optional<double> pace);

  /// The next line, when it is due; nothing at the end.
  [[nodiscard]] std::optional<std::string> next();
  /// Whether it was an interrupt that ended the lines.
  [[nodiscard]] bool interrupted() const { return interrupted_; }
  /// Why the line number() could not be read, which ended the lines; empty: it was not that.
  [[nodiscard]] const std::string& failure() const { return failure_; }
  /// The number of the line that next() returned, from 1.
  [[nodiscard]] std::size_t number() const { return number_; }

 private:
  Lines(int file, int interrupts, std::optional<double> pace)
      : file_(file), interrupts_(interrupts), pace_(pace) {}

  [[nodiscard]] bool wait_until_due();
  [[nodiscard]] bool fill();
  [[nodiscard]] std::nullopt_t end_by(const std::string& failure);

  Descriptor file_;
  Descriptor interrupts_;
  std::optional<double> pace_;
  std::chrono::steady_clock::time_point due_ = std::chrono::steady_clock::now();  // the next line
  std::string buffer_;
  std::size_t at_ = 0;  // the beginning of the next line in the buffer
  bool ended_ = false;
  bool interrupted_ = false;
  std::string failure_;
  std::size_t number_ = 0;
};

}  // namespace tfdude::cli
