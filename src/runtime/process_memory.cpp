#include "runtime/process_memory.hpp"

#include <cstddef>
#include <cstdint>
#include <utility>

namespace tfdude {
namespace {

// Addresses, of which only those take memory that are used: more than the largest partition has.
constexpr auto kReserved =
    static_cast<std::size_t>(std::uint64_t{sizeof(void*) == 8 ? 8192 : 256} << 20U);

}  // namespace

ProcessMemory ProcessMemory::open(bool wanted, bool owns) {
  ProcessMemory memory;
  if (!wanted) {
    memory.why_not = "it is switched off there";
    return memory;
  }
  memory.port = make_linux_memory();
  if (!owns) return memory;
  auto own = memory.port->create(kReserved);
  if (!own) {
    memory.why_not = std::move(own.error().message);
    return memory;
  }
  // The arena keeps the memory.
  auto arena = std::make_unique<Arena>(own->at.get(), own->size);
  memory.arena = {arena.release(), [at = std::move(own->at)](Arena* of) { delete of; }};
  return memory;
}

}  // namespace tfdude
