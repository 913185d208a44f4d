#include "runtime/calls.hpp"

#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"

namespace tfdude {

Calls::Call::Call(Calls& calls, const std::vector<std::string>& partitions,
                  std::function<void()> arrived)
    : calls_(calls), tell_(std::move(arrived)) {
  const Lock lock(calls_.mutex_);
  if (calls_.idle_signals_.empty()) {
    calls_.signals_.push_back(std::make_unique<Signal>());
    calls_.idle_signals_.push_back(calls_.signals_.back().get());
  }
  arrived_ = calls_.idle_signals_.back();
  calls_.idle_signals_.pop_back();
  entries_.reserve(partitions.size());
  for (const std::string& partition : partitions) {
    calls_.waiting_.emplace(++calls_.last_, Waiting{this, entries_.size()});
    entries_.push_back({partition, static_cast<std::uint32_t>(calls_.last_), std::nullopt});
  }
  awaits_from_ = calls_.waiting_.empty() ? calls_.last_ + 1 : calls_.waiting_.begin()->first;
}

Calls::Call::~Call() {
  const Lock lock(calls_.mutex_);
  for (const Entry& entry : entries_) calls_.waiting_.erase(calls_.number_of(entry.sequence));
  calls_.idle_signals_.push_back(arrived_);
}

bool Calls::Call::complete() const {
  return std::all_of(entries_.begin(), entries_.end(),
                     [](const Entry& entry) { return entry.reply.has_value(); });
}

bool Calls::Call::wait_until(Clock::time_point deadline) {
  Lock lock(calls_.mutex_);
  return arrived_->wait_until(lock, deadline, [this] { return complete(); });
}

bool Calls::Call::waits(std::size_t entry) const {
  const Lock lock(calls_.mutex_);
  return !entries_[entry].reply.has_value();
}

void Calls::Call::give_up(std::size_t entry, Error error) {
  const Lock lock(calls_.mutex_);
  if (entries_[entry].reply) return;
  entries_[entry].reply = Reply{entries_[entry].sequence, 0, std::move(error)};
}

void Calls::on_reply(const std::string& from, const Reply& reply) {
  Signal* arrived = nullptr;
  std::function<void()> tell;
  {
    const Lock lock(mutex_);
    const auto waiting = waiting_.find(number_of(reply.sequence));
    if (waiting == waiting_.end()) return;
    const Call& call = *waiting->second.call;
    auto& entry = waiting->second.call->entries_[waiting->second.entry];
    if (entry.reply || entry.partition != from) return;
    entry.reply = reply;
    if (call.complete()) {
      arrived = call.arrived_;
      tell = call.tell_;
    }
  }
  if (arrived != nullptr) arrived->notify_one();
  if (tell) tell();
}

void Calls::on_lost(const std::string& partition) {
  std::vector<std::function<void()>> tell;
  {
    const Lock lock(mutex_);
    for (auto& [number, waiting] : waiting_) {
      auto& entry = waiting.call->entries_[waiting.entry];
      if (entry.partition != partition || entry.reply) continue;
      entry.reply = Reply{
          entry.sequence, 0,
          Error{Errc::kUnreachable, "partition " + quote(partition) + " left before it replied"}};
      if (!waiting.call->complete()) continue;
      waiting.call->arrived_->notify_one();
      if (waiting.call->tell_) tell.push_back(waiting.call->tell_);
    }
  }
  for (const auto& one : tell) one();
}

}  // namespace tfdude
