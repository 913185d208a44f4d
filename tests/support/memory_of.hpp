#pragma once

#include <fstream>
#include <string>
#include <unistd.h>

#include "support/process.hpp"

namespace tfdude::testing {

/// Resident memory of a process [MiB].
inline long memory_of(const Process& process) {
  std::ifstream file("/proc/" + std::to_string(process.pid()) + "/statm");
  long total = 0;
  long resident = 0;
  file >> total >> resident;
  return resident * sysconf(_SC_PAGESIZE) / (1024 * 1024);
}

}  // namespace tfdude::testing
