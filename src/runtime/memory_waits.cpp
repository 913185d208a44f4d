#include "runtime/memory_waits.hpp"

#include <algorithm>
#include <system_error>
#include <utility>
#include <vector>

#include "base/log.hpp"
#include "base/thread_name.hpp"
#include "memory/waiting.hpp"

namespace tfdude {
namespace {

// How long it sleeps at most: an owner may not know yet that it is waited for.
constexpr std::chrono::milliseconds kLongest{100};

}  // namespace

void MemoryWaits::stop() {
  std::thread ending;
  {
    const Lock lock(mutex_);
    stopping_ = true;
    ending = std::move(thread_);
    note_change();
  }
  if (ending.joinable()) ending.join();
}

void MemoryWaits::note_change() {
  ++changes_;
  wake_waiting(changes_);
}

void MemoryWaits::wait_for(Owners owners) {
  std::shared_ptr<const Owners> before;  // released without the lock, with its memory
  const Lock lock(mutex_);
  if (stopping_) return;
  const bool same = std::equal(owners.begin(), owners.end(), owners_->begin(), owners_->end(),
                               [](const auto& a, const auto& b) {
                                 return a.first == b.first && a.second.forest == b.second.forest;
                               });
  if (same) return begin();
  before = std::exchange(owners_, std::make_shared<const Owners>(std::move(owners)));
  for (const auto& [owner, waited] : *before) {
    const auto now = owners_->find(owner);
    const bool goes_on = now != owners_->end() && now->second.forest == waited.forest;
    if (!goes_on) waited.memory.tell_waiting(false);
  }
  for (const auto& [owner, waited] : *owners_) waited.memory.tell_waiting(true);
  note_change();
  begin();
}

void MemoryWaits::begin() {
  if (thread_.joinable() || owners_->empty()) return;
  try {
    thread_ = std::thread([this] { run(); });
  } catch (const std::system_error& error) {
    log().error("no thread 'tfdude-wait': changes in the memory of owners are not told: {}",
                error.what());
  }
}

void MemoryWaits::run() {
  name_this_thread("tfdude-wait");
  std::vector<WaitedNumber> numbers;
  while (true) {
    // The numbers are taken before it is looked at what they tell.
    numbers = {{&changes_, changes_.load()}};
    std::shared_ptr<const Owners> owners;
    {
      const Lock lock(mutex_);
      if (stopping_) return;
      owners = owners_;
    }
    for (const auto& [owner, waited] : *owners) {
      if (numbers.size() == kMostWaitedNumbers) break;
      numbers.push_back({&waited.forest->committed(), waited.forest->snapshot()});
    }
    const auto again = on_commits_();
    const auto idle_until = owners->empty() ? kNever : Clock::now() + kLongest;
    wait_for_numbers(numbers, std::min(again, idle_until));
  }
}

}  // namespace tfdude
