#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>

#include "tfdude/base/result.hpp"

#include "partition/messages.hpp"

namespace tfdude {

/// Memory of this process that others may read once it is offered.
struct OwnMemory {
  std::shared_ptr<void> at;  ///< of zeros, aligned to a page
  std::size_t size = 0;
};

/// Memory of another process, for reading, as long as this exists. Its size does not change.
struct MappedMemory {
  std::shared_ptr<const void> at;
  std::size_t size = 0;
  /// Tells its owner whether somebody here waits for what it writes.
  std::function<void(bool waits)> tell_waiting{};
};

/// How processes of one computer read each other's memory. Nothing is sent through it: requests and
/// replies find out who may read, and everything else is in the memory.
/// @par Thread safety  All functions are thread-safe.
class SharedMemory {
 public:
  virtual ~SharedMemory() = default;

  /// @return kUnsupported: this computer, or a limit of this process, does not allow it
  [[nodiscard]] virtual Result<OwnMemory> create(std::size_t size) = 0;

  /// From now on who shows the token of the offer may read what was created last. Once.
  /// @param layout  what readers must have in common with this process
  /// @param on_waiting  called by another thread: whether any reader waits for what is written
  /// @return the offer, without an incarnation; kUnsupported
  [[nodiscard]] virtual Result<MemoryOffer> offer(std::uint64_t layout,
                                                  std::function<void(bool waits)> on_waiting) = 0;

  /// Waits for the other process, but at most for 200 ms.
  /// @param on_end  called at most once, by another thread: the memory is not offered any more, and
  ///   whether that is because its process has died. May still be called while the memory is
  ///   released, but not after this object is destroyed
  /// @return kUnsupported: it is on another computer, or has another layout, or cannot be reached
  ///   from here, as in some containers; kTimeout
  [[nodiscard]] virtual Result<MappedMemory> attach(const MemoryOffer& offer, std::uint64_t layout,
                                                    std::function<void(bool died)> on_end) = 0;
};

/// That of Linux: sealed memory without a name (memfd), which its owner passes over a unix socket.
/// The kernel closes the socket when either side ends. There are no files, and nothing is left when
/// a process is killed.
[[nodiscard]] std::unique_ptr<SharedMemory> make_linux_memory();

}  // namespace tfdude
