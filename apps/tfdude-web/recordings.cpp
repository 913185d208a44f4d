#include "recordings.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fcntl.h>
#include <sys/statvfs.h>
#include <system_error>
#include <unistd.h>
#include <utility>

#include "../environment.hpp"
#include "upload.hpp"

namespace tfdude::web {
namespace {

// Of the disk, for the robot: its state files may be there, too.
constexpr std::uint64_t kLeftFree = std::uint64_t{256} << 20U;

std::string reason() { return std::generic_category().message(errno); }

// Not /tmp, which may be memory.
std::string folder() {
  const std::string chosen = cli::environment("TMPDIR");
  return chosen.empty() ? "/var/tmp" : chosen;
}

}  // namespace

SentRecording::~SentRecording() {
  stop();
  if (file_ >= 0) close(file_);
}

// The registry keeps this object while anything is asked.
template <class T>
void SentRecording::run(std::function<T()> work, Then<T> then) {
  ++asked_;
  const bool posted = worker_.post([this, work = std::move(work), then = std::move(then)] {
    auto result = std::make_shared<T>(work());
    post_([this, result, then] {
      --asked_;
      if (!left_) then(std::move(*result));
    });
  });
  if (!posted) --asked_;  // cannot be: a page waits for what it has asked
}

void SentRecording::write(std::string piece, Then<Result<void>> then) {
  run<Result<void>>([this, piece = std::move(piece)] { return append(piece); }, std::move(then));
}

void SentRecording::open(Then<Result<std::vector<Told>>> then) {
  run<Result<std::vector<Told>>>([this] { return begin(); }, std::move(then));
}

void SentRecording::show(Time at, const std::string& a, const std::string& b,
                         Then<Result<std::vector<Told>>> then) {
  run<Result<std::vector<Told>>>([this, at, a, b] { return reader_->at(at, a, b); },
                                 std::move(then));
}

void SentRecording::leave() {
  if (std::exchange(left_, true)) return;
  cancel();
  // Removing a large file takes a while.
  run<bool>(
      [this] {
        {
          const std::lock_guard<std::mutex> lock(mutex_);
          reader_.reset();
        }
        return close(std::exchange(file_, -1)) == 0;
      },
      nullptr);
}

void SentRecording::cancel() {
  cancelled_ = true;
  const std::lock_guard<std::mutex> lock(mutex_);
  if (reader_) reader_->cancel();
}

void SentRecording::stop() {
  cancel();
  worker_.stop();
}

Result<void> SentRecording::append(const std::string& piece) {
  std::size_t done = 0;
  while (done < piece.size() && !cancelled_) {
    const ssize_t count =
        pwrite(file_, piece.data() + done, piece.size() - done, static_cast<off_t>(written_));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return fail(Errc::kConfig, "the server cannot keep the file: " + reason());
    done += static_cast<std::size_t>(count);
    written_ += static_cast<std::uint64_t>(count);
  }
  return {};
}

Result<std::vector<Told>> SentRecording::begin() {
  auto reader = ReaderProcess::start(file_);
  if (!reader) return tl::unexpected(reader.error());
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    reader_ = *std::move(reader);
  }
  if (cancelled_) reader_->cancel();
  return reader_->begin();
}

Result<SentRecording*> Recordings::begin(std::uint64_t bytes) {
  if (auto ok = check_size(bytes, most_bytes_); !ok) return tl::unexpected(ok.error());
  tick();
  if (all_.size() >= kMost) {
    return fail(Errc::kTooMuch, "pages show " + std::to_string(kMost) +
                                    " recordings already, which is all that this server reads");
  }
  const auto file = make_file(bytes);
  if (!file) return tl::unexpected(file.error());
  try {
    all_.push_back(std::unique_ptr<SentRecording>(new SentRecording(*file, bytes, post_)));
  } catch (const std::system_error&) {
    close(*file);
    return fail(Errc::kTooMuch, "the server has no thread for the file");
  }
  return all_.back().get();
}

void Recordings::tick() {
  const auto done = [](const auto& one) { return one->left_ && one->asked_ == 0; };
  all_.erase(std::remove_if(all_.begin(), all_.end(), done), all_.end());
}

void Recordings::stop() {
  for (const auto& one : all_) one->stop();
}

Result<int> Recordings::make_file(std::uint64_t bytes) const {
  std::string name = folder() + "/tfdude-web-XXXXXX";
  const int file = mkostemp(name.data(), O_CLOEXEC);  // for its user only
  if (file < 0) return fail(Errc::kTooMuch, "the server has no place for files: " + reason());
  if (unlink(name.c_str()) != 0) {
    close(file);
    return fail(Errc::kTooMuch, "the server cannot hide the file: " + reason());
  }
  struct statvfs disk {};
  // What the others will have counts as taken, also as far as it is written.
  std::uint64_t needed = bytes + kLeftFree;
  for (const auto& one : all_) needed += one->left_ ? 0 : one->bytes_;
  if (fstatvfs(file, &disk) == 0 && disk.f_bavail > 0 && disk.f_bavail >= needed / disk.f_frsize) {
    return file;
  }
  close(file);
  return fail(Errc::kTooMuch, "the server's disk has no room for the file");
}

}  // namespace tfdude::web
