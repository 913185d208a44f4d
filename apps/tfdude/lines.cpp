#include "lines.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <poll.h>
#include <string_view>
#include <sys/signalfd.h>
#include <unistd.h>

#include "tfdude/base/id.hpp"

#include "../stop_signals.hpp"
#include "answer.hpp"

namespace tfdude::cli {
namespace {

constexpr std::size_t kLongest = std::size_t{16} << 20U;

}  // namespace

Result<Lines> Lines::open(const std::string& file, std::optional<double> pace) {
  // A pipe without a writer is waited for in fill(), which a signal ends.
  const int opened =
      file == "-" ? dup(STDIN_FILENO) : ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (opened < 0) {
    return fail(Errc::kConfig, "cannot read " + quote(file) + ": " + std::strerror(errno));
  }
  const sigset_t signals = stop_signals();
  return Lines(opened, signalfd(-1, &signals, SFD_CLOEXEC), pace);
}

// Keeps to a schedule, so that small delays do not add up. After a long one it goes on from there,
// instead of sending what was due meanwhile all at once.
bool Lines::wait_until_due() {
  if (!pace_) return true;
  const auto now = std::chrono::steady_clock::now();
  const std::chrono::duration<double> left = due_ - now;
  interrupted_ = left.count() > 0 && interrupted_within(left.count());
  if (interrupted_) return false;
  const auto period = std::chrono::nanoseconds(std::llround(1e9 / *pace_));
  due_ = std::max(due_ + period, now);
  return true;
}

// Reads what there is, waiting for something. @return false at the end, or if interrupted
bool Lines::fill() {
  std::array<pollfd, 2> sources{{{file_.get(), POLLIN, 0}, {interrupts_.get(), POLLIN, 0}}};
  while (poll(sources.data(), sources.size(), -1) < 0) {
    if (errno != EINTR) return false;
  }
  interrupted_ = sources[1].revents != 0;
  buffer_.erase(0, interrupted_ ? buffer_.size() : at_);
  at_ = 0;
  if (interrupted_) return false;
  std::array<char, 65536> block{};
  const ssize_t size = read(file_.get(), block.data(), block.size());
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return true;
  if (size < 0) (void)end_by(std::string("cannot be read: ") + std::strerror(errno));
  if (size <= 0) return false;
  buffer_.append(block.data(), static_cast<std::size_t>(size));
  return true;
}

// What there is of that line is no line.
std::nullopt_t Lines::end_by(const std::string& failure) {
  failure_ = failure;
  ended_ = true;
  buffer_ = {};
  at_ = 0;
  ++number_;
  return std::nullopt;
}

std::optional<std::string> Lines::next() {
  if (!wait_until_due()) return std::nullopt;
  std::size_t end = buffer_.find('\n', at_);
  while (end == std::string::npos && !ended_ && buffer_.size() - at_ <= kLongest) {
    const std::size_t searched = buffer_.size() - at_;
    ended_ = !fill();
    end = buffer_.find('\n', searched);
  }
  if (end == std::string::npos) end = buffer_.size();  // the last line may lack its end
  if (end - at_ > kLongest) return end_by("it is longer than 16 MiB");
  if (at_ == buffer_.size() && end == buffer_.size()) return std::nullopt;
  std::string line = buffer_.substr(at_, end - at_);
  at_ = std::min(end + 1, buffer_.size());
  // The byte order mark that some editors write.
  constexpr std::string_view kMark = "\xef\xbb\xbf";
  if (++number_ == 1 && line.rfind(kMark, 0) == 0) line.erase(0, kMark.size());
  return line;
}

}  // namespace tfdude::cli
