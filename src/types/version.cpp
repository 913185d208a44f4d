#include "tfdude/types/version.hpp"

namespace tfdude {

std::string to_string(ProtocolVersion version) {
  return std::to_string(version.major) + "." + std::to_string(version.minor);
}

std::string program_version() { return TFDUDE_VERSION; }

std::string version_line() {
  return "tf-dude " + program_version() + ", protocol " + to_string(kProtocolVersion) +
         ", Fast DDS " TFDUDE_FASTDDS_VERSION ", " TFDUDE_BUILD_TYPE " build";
}

}  // namespace tfdude
