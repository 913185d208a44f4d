#pragma once

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <string>
#include <sys/mount.h>

#include "support/process.hpp"

namespace tfdude::testing {

/// A separate disk that is so small that it is soon full. Where it cannot be mounted, for example
/// without root, missing() says why.
class SmallDisk {
 public:
  explicit SmallDisk(int kibibytes) {
    const std::string size = "size=" + std::to_string(kibibytes) + "k";
    mounted_ = mount("tmpfs", path().c_str(), "tmpfs", 0, size.c_str()) == 0;
    if (!mounted_) missing_ = std::string("no small disk can be mounted: ") + std::strerror(errno);
  }
  ~SmallDisk() {
    if (mounted_) (void)umount2(path().c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  [[nodiscard]] bool mounted() const { return mounted_; }
  /// Empty if it is mounted.
  [[nodiscard]] const std::string& missing() const { return missing_; }
  [[nodiscard]] const std::string& path() const { return directory_.path(); }

  /// Fills the disk to the last byte.
  void fill() const {
    std::ofstream filler(file(), std::ios::binary | std::ios::app);
    const std::string block(1024, 'x');
    while (filler.write(block.data(), static_cast<std::streamsize>(block.size())).flush()) {
    }
  }
  void make_room() const { (void)std::remove(file().c_str()); }

 private:
  [[nodiscard]] std::string file() const { return path() + "/filler"; }

  TemporaryDirectory directory_;
  bool mounted_ = false;
  std::string missing_;
};

}  // namespace tfdude::testing
