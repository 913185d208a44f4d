#pragma once

#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>

namespace tfdude::testing {

/// The UDP sockets of this process by their inodes.
[[nodiscard]] inline std::set<std::string> own_sockets() {
  std::set<std::string> inodes;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code gone;
    const std::string target = std::filesystem::read_symlink(entry.path(), gone).string();
    constexpr const char* kPrefix = "socket:[";
    if (target.rfind(kPrefix, 0) != 0) continue;
    inodes.insert(target.substr(8, target.size() - 9));
  }
  return inodes;
}

/// The local addresses of those of them that are bound to one of UDP, as the kernel writes them
/// ("0100007F" is 127.0.0.1).
[[nodiscard]] inline std::multiset<std::string> addresses_of(const std::set<std::string>& inodes) {
  std::multiset<std::string> addresses;
  std::ifstream table("/proc/net/udp");
  std::string line;
  std::getline(table, line);
  while (std::getline(table, line)) {
    std::istringstream fields(line);
    std::string slot, local, field, inode;
    fields >> slot >> local;
    for (int i = 0; i < 7; ++i) fields >> field;
    fields >> inode;
    if (inodes.count(inode) != 0) addresses.insert(local.substr(0, local.find(':')));
  }
  return addresses;
}

}  // namespace tfdude::testing
