#include "tree/epoch.hpp"

#include <limits>

namespace tfdude::epoch {

std::atomic<std::uint64_t> current{1};  // NOLINT(*-avoid-non-const-global-variables): see epoch.hpp

namespace {

// NOLINTNEXTLINE(*-avoid-non-const-global-variables): one reader per thread, for all trees
std::atomic<Reader*> all_readers{nullptr};

Reader* take_reader() {
  for (Reader* r = all_readers.load(std::memory_order_acquire); r != nullptr; r = r->next) {
    bool expected = false;
    if (r->taken.compare_exchange_strong(expected, true, std::memory_order_acq_rel)) return r;
  }
  auto* r = new Reader;
  r->next = all_readers.load(std::memory_order_relaxed);
  // seq_cst, as the announcements: a scan that misses this reader precedes all that it reads.
  while (!all_readers.compare_exchange_weak(r->next, r, std::memory_order_seq_cst)) {
  }
  return r;
}

// Releases the reader when its thread ends.
struct Lease {
  Lease() = default;
  ~Lease() { reader->taken.store(false, std::memory_order_release); }
  Lease(const Lease&) = delete;
  Lease& operator=(const Lease&) = delete;

  Reader* reader = take_reader();
};

}  // namespace

Reader& this_thread() {
  thread_local Lease lease;
  return *lease.reader;
}

std::uint64_t safe_below() {
  std::uint64_t oldest = std::numeric_limits<std::uint64_t>::max();
  for (Reader* r = all_readers.load(std::memory_order_seq_cst); r != nullptr; r = r->next) {
    const std::uint64_t announced = r->announced.load(std::memory_order_seq_cst);
    if (announced != 0 && announced < oldest) oldest = announced;
  }
  return oldest;
}

}  // namespace tfdude::epoch
