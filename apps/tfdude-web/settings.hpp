#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/types/options.hpp"

#include "server.hpp"

namespace tfdude::web {

struct Settings {
  Options options;
  ServerSettings server;
  std::string urdf;                    ///< of the robot whose shapes are shown; empty: none
  std::vector<std::string> packages;   ///< folders of its packages
  std::vector<std::string> origins;    ///< of other pages that may connect
  std::uint64_t most_recording = 256;  ///< size of a recording that a page sends [MiB]; 0: none
};

/// Reads the command line. @return the exit status, if the program ends here
[[nodiscard]] std::optional<int> read_arguments(int argc, char** argv, Settings& settings);

}  // namespace tfdude::web
