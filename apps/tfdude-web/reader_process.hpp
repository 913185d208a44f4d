#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <sys/types.h>
#include <vector>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"

#include "recorded_view.hpp"

// A recording that a page has sent is read by a process of its own. Whatever is in the file, that
// process has so much memory and time, and ends with the page.
namespace tfdude::web {

/// The argument with which the program is such a process.
inline constexpr const char* kReaderArgument = "--read-recording";

/// The process's side: reads the file and answers, until the other side closes. @return exit status
[[nodiscard]] int read_recording();

/// The server's side.
/// @par Thread safety  cancel() from any thread, the rest from one.
class ReaderProcess {
 public:
  /// Its address space [B].
  static constexpr std::uint64_t kMostMemory = std::uint64_t{1536} << 20U;
  static constexpr std::chrono::seconds kAnswerTime{30};

  /// Starts one for an open file. @return kTooMuch: it cannot be started
  [[nodiscard]] static Result<std::unique_ptr<ReaderProcess>> start(int file);
  ~ReaderProcess();
  ReaderProcess(const ReaderProcess&) = delete;
  ReaderProcess& operator=(const ReaderProcess&) = delete;

  /// As RecordedView::open() and begin(), and RecordedView::at(). Wait for the process, at most
  /// kAnswerTime. After an error it has ended.
  /// @return also kTooMuch: it took too much memory or time
  [[nodiscard]] Result<std::vector<Told>> begin();
  [[nodiscard]] Result<std::vector<Told>> at(Time instant, const std::string& a,
                                             const std::string& b);
  /// A call that waits returns at once, with an error.
  void cancel() const;

 private:
  ReaderProcess(int socket, pid_t pid) : socket_(socket), pid_(pid) {}
  [[nodiscard]] Result<std::vector<Told>> ask(const std::string& question);
  void end();

  int socket_;
  pid_t pid_;  // 0: it has ended
};

}  // namespace tfdude::web
