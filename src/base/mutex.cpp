#include "base/mutex.hpp"

#include <array>
#include <cstddef>
#include <cstdio>
#include <cstdlib>

namespace tfdude {
namespace {

// NOLINTNEXTLINE(*-avoid-non-const-global-variables): of this thread alone
thread_local std::array<int, static_cast<std::size_t>(LockRank::kLeaf) + 1> t_held{};

}  // namespace

void HeldLocks::wait_for(LockRank rank) {
  for (auto held = static_cast<std::size_t>(rank); held < t_held.size(); ++held) {
    if (t_held[held] == 0) continue;
    // By no log: the log has locks, too.
    (void)std::fprintf(stderr, "a lock of rank %d is awaited while one of rank %zu is held\n",
                       static_cast<int>(rank), held);
    std::abort();
  }
}

void HeldLocks::add(LockRank rank) { ++t_held[static_cast<std::size_t>(rank)]; }

void HeldLocks::remove(LockRank rank) { --t_held[static_cast<std::size_t>(rank)]; }

}  // namespace tfdude
