#pragma once

#include <cerrno>
#include <fcntl.h>
#include <unistd.h>

namespace tfdude::cli {

/// Before a program opens anything. A program may be started without standard input, output or
/// error. The next file or socket that it opens would get that number, and what it prints would be
/// written there: into a recording, for example. So these numbers are taken, in such a way that
/// output fails as it would without.
inline void hold_standard_descriptors() {
  for (const int number : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(number, F_GETFD) >= 0 || errno != EBADF) continue;
    // The least number that is free. Nobody reads or writes it with success.
    (void)open("/dev/null", number == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
}

}  // namespace tfdude::cli
