// What a power loss leaves of a state file: when SQLite syncs it.

#include <atomic>
#include <cerrno>
#include <sys/syscall.h>
#include <unistd.h>

#include "store/sqlite_store.hpp"
#include "support/catch.hpp"
#include "support/process.hpp"

namespace {

std::atomic<int> synced{0};

int sync(long call, int file) {
  ++synced;
  return static_cast<int>(syscall(call, file));
}

}  // namespace

// Called by SQLite instead of those of the C library.
extern "C" int fsync(int file) { return sync(SYS_fsync, file); }
extern "C" int fdatasync(int file) { return sync(SYS_fdatasync, file); }

namespace tfdude {

TEST_CASE(
    "the first change of a process, and each with a new number of it, is synced without sync, "
    "too") {
  const testing::TemporaryDirectory directory;
  const std::string file = state_file(directory.path(), 7, "arms");
  const auto sync = GENERATE(StoreSync::kAtCheckpoints, StoreSync::kEachChange);
  // The second process finds a file.
  for (int process = 0; process < 2; ++process) {
    const auto store = open_sqlite_store(file, "arms", sync);
    REQUIRE(store);
    const auto save = [&](bool new_number = false) {
      StateChange change{1, {"hand"}, {{"hand", "", {}, 1}}, {}};
      change.synced = new_number;
      const int before = synced;
      REQUIRE((*store)->save(change));
      return synced > before;
    };
    CHECK(save());
    const bool again = save();
    CHECK(again == (sync == StoreSync::kEachChange));
    CHECK(save(true));
    CHECK(save() == again);
  }
}

}  // namespace tfdude
