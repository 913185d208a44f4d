// Preloaded into a process, this makes its disk slow: each sync takes TFDUDE_SYNC_MS longer, if
// the file TFDUDE_SYNC_IF exists, or none is named.

#include <chrono>
#include <cstdlib>
#include <sys/syscall.h>
#include <thread>
#include <unistd.h>

namespace {

void take_long() {
  const char* milliseconds = std::getenv("TFDUDE_SYNC_MS");
  if (milliseconds == nullptr) return;
  const char* file = std::getenv("TFDUDE_SYNC_IF");
  if (file != nullptr && access(file, F_OK) != 0) return;
  std::this_thread::sleep_for(std::chrono::milliseconds(std::atoi(milliseconds)));
}

}  // namespace

extern "C" {

int fsync(int file) {
  take_long();
  return static_cast<int>(syscall(SYS_fsync, file));
}

int fdatasync(int file) {
  take_long();
  return static_cast<int>(syscall(SYS_fdatasync, file));
}
}
