#include "base/mutex.hpp"

#include <csignal>
#include <functional>
#include <sys/wait.h>
#include <unistd.h>

#include "support/catch.hpp"

namespace tfdude {
namespace {

/// Whether a process that does this is aborted.
bool aborts(const std::function<void()>& action) {
  const pid_t child = fork();
  if (child == 0) {
    action();
    _exit(0);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  return WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT;
}

}  // namespace

TEST_CASE("locks: a thread may wait only for locks of a later rank than those it holds") {
  const auto waits = [](LockRank held, LockRank next) {
    return [held, next] {
      (void)signal(SIGABRT, SIG_DFL);
      HeldLocks::add(held);
      HeldLocks::wait_for(next);
    };
  };
  CHECK_FALSE(aborts(waits(LockRank::kStructure, LockRank::kForest)));
  CHECK(aborts(waits(LockRank::kForest, LockRank::kStructure)));
  CHECK(aborts(waits(LockRank::kLeaf, LockRank::kLeaf)));
  CHECK_FALSE(aborts([] {
    HeldLocks::add(LockRank::kForest);
    HeldLocks::remove(LockRank::kForest);
    HeldLocks::wait_for(LockRank::kStructure);
  }));
}

TEST_CASE("locks: a build that checks the order aborts a process that violates it") {
  Mutex structure(LockRank::kStructure);
  Mutex leaf;
  const bool aborted = aborts([&] {
    (void)signal(SIGABRT, SIG_DFL);
    const Lock first(leaf);
    const Lock second(structure);
  });
  CHECK(aborted == kCheckLockOrder);
  CHECK_FALSE(aborts([&] {
    const Lock first(structure);
    const Lock second(leaf);
  }));
}

}  // namespace tfdude
