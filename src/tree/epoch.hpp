#pragma once

#include <atomic>
#include <cstdint>

// Epoch-based reclamation: readers of shared memory announce that they read. Writers reuse unlinked
// memory only when all readers that could have seen it have finished. Fraser, "Practical
// lock-freedom", 2004, section 5.2.3, with the oldest announced epoch instead of his three
// generations.
//
// Why it is safe: a reader announces the epoch (seq_cst), then loads the commit number (seq_cst),
// and only then follows links. A writer unlinks, stores the commit number (seq_cst), takes the tag
// with retire_tag(), then scans. If the scan misses a reader, then in the single order of seq_cst
// operations the reader loads the commit number after all these steps, so it sees the unlinking. If
// a reader still saw the old link, the scan sees it, and it announced an epoch <= the tag. Many
// commits may share one tag, taken after the last of them.
namespace tfdude::epoch {

/// One per reading thread, reused by later threads; never freed.
struct alignas(64) Reader {
  std::atomic<std::uint64_t> announced{0};  // 0: not reading
  std::atomic<bool> taken{true};
  Reader* next = nullptr;  // list of all readers, set once
  unsigned depth = 0;      // of nested guards; accessed by its own thread only
};

/// The calling thread's reader, created at first use.
Reader& this_thread();

/// The epoch to announce; starts at 1.
extern std::atomic<std::uint64_t>
    current;  // NOLINT(*-avoid-non-const-global-variables): shared by all trees

/// While a guard lives, nothing that its thread can reach is reused.
class Guard {
 public:
  Guard() : reader_(this_thread()) {
    if (reader_.depth++ == 0) {
      // acquire: a reader that announces the epoch after a tag also sees the unlinking before it.
      reader_.announced.store(current.load(std::memory_order_acquire), std::memory_order_seq_cst);
    }
  }
  ~Guard() {
    if (--reader_.depth == 0) reader_.announced.store(0, std::memory_order_release);
  }
  Guard(const Guard&) = delete;
  Guard& operator=(const Guard&) = delete;

 private:
  Reader& reader_;
};

/// The tag for everything unlinked before the last seq_cst store of a commit.
inline std::uint64_t retire_tag() { return current.fetch_add(1, std::memory_order_seq_cst); }

/// Everything with a tag below this may be reused.
std::uint64_t safe_below();

}  // namespace tfdude::epoch
