#pragma once

#include <cstddef>
#include <memory>
#include <stdexcept>
#include <sys/mman.h>
#include <unistd.h>

#include "tree/arena.hpp"
#include "tree/forest.hpp"
#include "tree/remote_forest.hpp"

namespace tfdude::testing {

/// Memory that is mapped twice, as by an owner and by a reader in another process.
class TwiceMapped {
 public:
  explicit TwiceMapped(std::size_t size) : size_(size), fd_(memfd_create("tfdude test", 0)) {
    if (fd_ < 0 || ftruncate(fd_, static_cast<off_t>(size)) != 0) throw std::runtime_error("memfd");
    written_ = map(PROT_READ | PROT_WRITE);
    read_ = map(PROT_READ);
  }
  ~TwiceMapped() {
    munmap(written_, size_);
    munmap(read_, size_);
    close(fd_);
  }
  TwiceMapped(const TwiceMapped&) = delete;
  TwiceMapped& operator=(const TwiceMapped&) = delete;

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] void* written() const { return written_; }
  [[nodiscard]] const void* read() const { return read_; }

 private:
  [[nodiscard]] void* map(int protection) const {
    void* at = mmap(nullptr, size_, protection, MAP_SHARED, fd_, 0);
    if (at == MAP_FAILED) throw std::runtime_error("mmap");
    return at;
  }

  std::size_t size_;
  int fd_;
  void* written_ = nullptr;
  void* read_ = nullptr;
};

/// A forest in such memory.
struct SharedForest {
  explicit SharedForest(std::size_t size = std::size_t{64} << 20U)
      : memory(size),
        arena(std::make_shared<Arena>(memory.written(), memory.size())),
        forest(nullptr, arena) {}

  /// As another process reads it.
  [[nodiscard]] RemoteForest seen() const {
    return RemoteForest::open(memory.read(), memory.size()).value();
  }

  TwiceMapped memory;
  std::shared_ptr<Arena> arena;
  Forest forest;
};

}  // namespace tfdude::testing
