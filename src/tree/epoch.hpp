#pragma once

#include <atomic>
#include <cstdint>

// Epoch-based reclamation: readers of shared memory announce that they read, writers reuse what they
// unlinked only when all readers that could have seen it are gone. Fraser, "Practical lock-freedom",
// 2004, section 5.2.3, with the oldest announced epoch in place of his three generations.
//
// Why it is safe: a reader announces the epoch (seq_cst), then loads what the writer has committed (seq_cst),
// and only then follows links. A writer unlinks, stores what it has committed (seq_cst), takes the tag with
// retire_tag(), then scans. A reader that the scan misses loads the commit after all these in the one order of
// seq_cst operations, so it sees the unlinking; one that still saw the old link is seen by the scan, and
// announced an epoch <= the tag. Many commits may share one tag, taken after the last of them.
namespace tfdude::epoch {

/// One per thread that reads, reused by later threads; never freed.
struct alignas(64) Reader {
  std::atomic<std::uint64_t> announced{0};  // 0: not reading
  std::atomic<bool> taken{true};
  Reader* next = nullptr;  // of all readers, set once
  unsigned depth = 0;      // of nested guards; only its own thread touches it
};

/// The calling thread's reader; made at its first use.
Reader& this_thread();

/// The epoch to announce; starts at 1.
extern std::atomic<std::uint64_t>
    current;  // NOLINT(*-avoid-non-const-global-variables): readers of all trees share it

/// While one lives, nothing that its thread can reach is reused.
class Guard {
 public:
  Guard() : reader_(this_thread()) {
    if (reader_.depth++ == 0) {
      // acquire: who announces the epoch after a tag also sees the unlinking before it.
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

/// The tag for all that was unlinked before the last seq_cst store of a commit.
inline std::uint64_t retire_tag() { return current.fetch_add(1, std::memory_order_seq_cst); }

/// What carries a tag below this may be reused.
std::uint64_t safe_below();

}  // namespace tfdude::epoch
