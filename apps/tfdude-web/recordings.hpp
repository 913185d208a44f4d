#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"

#include "../worker.hpp"
#include "reader_process.hpp"
#include "server.hpp"

// The recordings that pages have sent.
namespace tfdude::web {

/// One of them: a file without a name, so that it is gone with the server however that ends, and a
/// process that reads it. The functions are called on the server's thread, and wait for the disk
/// only to make the empty file; results are passed there, unless leave() was called before.
class SentRecording {
 public:
  template <class T>
  using Then = std::function<void(T)>;

  ~SentRecording();
  SentRecording(const SentRecording&) = delete;
  SentRecording& operator=(const SentRecording&) = delete;

  /// Appends to the file. @return kConfig: the disk is full
  void write(std::string piece, Then<Result<void>> then);
  /// Reads the file. The result is as of RecordedView::open() and begin().
  void open(Then<Result<std::vector<Told>>> then);
  /// As RecordedView::at().
  void show(Time at, const std::string& a, const std::string& b,
            Then<Result<std::vector<Told>>> then);
  /// The page does not need it any more, and must not use it: what it does ends, then its memory
  /// and its place on the disk are free.
  void leave();

 private:
  friend class Recordings;

  SentRecording(int file, std::uint64_t bytes, Post post)
      : file_(file), bytes_(bytes), post_(std::move(post)) {}
  template <class T>
  void run(std::function<T()> work, Then<T> then);
  void cancel();
  void stop();
  [[nodiscard]] Result<void> append(const std::string& piece);
  [[nodiscard]] Result<std::vector<Told>> begin();

  int file_;                   // of the worker; -1: closed
  const std::uint64_t bytes_;  // that it will have
  const Post post_;
  std::uint64_t asked_ = 0;  // tasks whose results are not here yet
  bool left_ = false;
  std::uint64_t written_ = 0;  // of the worker
  std::atomic<bool> cancelled_{false};
  std::mutex mutex_;
  std::unique_ptr<ReaderProcess> reader_;  // of the worker; the server cancels it
  cli::Worker worker_{32};                 // last: it uses the above
};

/// All of them. On the server's thread, until stop().
class Recordings {
 public:
  /// At once; each has a thread and a process.
  static constexpr std::size_t kMost = 4;

  /// @param most_bytes  of a file
  Recordings(std::uint64_t most_bytes, Post post)
      : most_bytes_(most_bytes), post_(std::move(post)) {}

  /// Makes room for a file of this size. The result lives until it is left.
  /// @return kTooMuch: the file or their number exceeds a limit, or the disk is full;
  ///   kInvalidInput: it is empty
  [[nodiscard]] Result<SentRecording*> begin(std::uint64_t bytes);
  /// Removes those that were left and do nothing any more.
  void tick();
  /// When the server has stopped: afterwards its Post is not called, and pages may only leave.
  void stop();

 private:
  [[nodiscard]] Result<int> make_file(std::uint64_t bytes) const;

  const std::uint64_t most_bytes_;
  const Post post_;
  std::vector<std::unique_ptr<SentRecording>> all_;
};

}  // namespace tfdude::web
