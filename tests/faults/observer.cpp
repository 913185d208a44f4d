#include "faults/observer.hpp"

#include "faults/worker.hpp"

namespace tfdude::faults {
namespace {

// The precision of an answer's time.
constexpr std::chrono::milliseconds kAskEvery{5};

}  // namespace

Observer::Observer(Client client) : client_(std::move(client)) {
  subscription_ = client_.on_change([this](const Change& change) {
    if (change.kind != ChangeKind::kPartitionDown) return;
    const std::lock_guard lock(mutex_);
    const auto died = died_.find(change.partition);
    if (died == died_.end()) return;
    until_gone_.push_back(milliseconds_since(died->second));
    died_.erase(died);
  });
  asking_ = std::thread([this] { ask_those_started(); });
}

Observer::~Observer() {
  stopping_ = true;
  asking_.join();
  subscription_ = {};
}

void Observer::died(std::size_t partition) {
  const std::lock_guard lock(mutex_);
  started_.erase(partition);
  died_[partition_name(partition)] = Clock::now();
}

void Observer::started(std::size_t partition) {
  const std::lock_guard lock(mutex_);
  // A daemon that returns before it counts as gone is not measured.
  died_.erase(partition_name(partition));
  started_[partition] = Clock::now();
}

void Observer::disregard(std::size_t partition) {
  const std::lock_guard lock(mutex_);
  started_.erase(partition);
  died_.erase(partition_name(partition));
}

void Observer::ask_those_started() {
  while (!stopping_) {
    std::map<std::size_t, Clock::time_point> started;
    {
      const std::lock_guard lock(mutex_);
      started = started_;
    }
    for (const auto& [partition, begin] : started) {
      if (!client_.lookup("world", base_of(partition))) continue;
      const std::lock_guard lock(mutex_);
      const auto measured = started_.find(partition);
      if (measured == started_.end() || measured->second != begin) continue;
      until_answer_.push_back(milliseconds_since(begin));
      started_.erase(measured);
    }
    std::this_thread::sleep_for(kAskEvery);
  }
}

std::vector<double> Observer::until_gone() const {
  const std::lock_guard lock(mutex_);
  return until_gone_;
}

std::vector<double> Observer::until_answer() const {
  const std::lock_guard lock(mutex_);
  return until_answer_;
}

std::size_t Observer::open() const {
  const std::lock_guard lock(mutex_);
  return started_.size();
}

}  // namespace tfdude::faults
