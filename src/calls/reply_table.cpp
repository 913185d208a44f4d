#include "calls/reply_table.hpp"

#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"

namespace tfdude {

ReplyTable::Call::Call(ReplyTable& table, const std::vector<std::string>& partitions,
                       ReplyListener* listener)
    : table_(table), listener_(listener) {
  const Lock lock(table_.mutex_);
  if (table_.idle_signals_.empty()) {
    table_.signals_.push_back(std::make_unique<Signal>());
    table_.idle_signals_.push_back(table_.signals_.back().get());
  }
  arrived_ = table_.idle_signals_.back();
  table_.idle_signals_.pop_back();
  entries_.reserve(partitions.size());
  for (const std::string& partition : partitions) {
    table_.waiting_.emplace(++table_.last_, Waiting{this, entries_.size()});
    entries_.push_back({partition, static_cast<std::uint32_t>(table_.last_), std::nullopt});
  }
  awaits_from_ = table_.waiting_.empty() ? table_.last_ + 1 : table_.waiting_.begin()->first;
}

ReplyTable::Call::~Call() {
  const Lock lock(table_.mutex_);
  for (const Entry& entry : entries_) table_.waiting_.erase(table_.number_of(entry.sequence));
  table_.idle_signals_.push_back(arrived_);
}

bool ReplyTable::Call::complete() const {
  return std::all_of(entries_.begin(), entries_.end(),
                     [](const Entry& entry) { return entry.reply.has_value(); });
}

bool ReplyTable::Call::wait_until(Clock::time_point deadline) {
  Lock lock(table_.mutex_);
  return arrived_->wait_until(lock, deadline, [this] { return complete(); });
}

bool ReplyTable::Call::waits(std::size_t entry) const {
  const Lock lock(table_.mutex_);
  return !entries_[entry].reply.has_value();
}

void ReplyTable::Call::give_up(std::size_t entry, Error error) {
  const Lock lock(table_.mutex_);
  if (entries_[entry].reply) return;
  entries_[entry].reply = Reply{entries_[entry].sequence, 0, std::move(error)};
}

void ReplyTable::on_reply(const std::string& from, const Reply& reply) {
  Signal* arrived = nullptr;
  ReplyListener* listener = nullptr;
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
      listener = call.listener_;
    }
  }
  if (arrived != nullptr) arrived->notify_one();
  if (listener != nullptr) listener->all_replied();
}

void ReplyTable::on_lost(const std::string& partition) {
  std::vector<ReplyListener*> listeners;
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
      if (waiting.call->listener_ != nullptr) listeners.push_back(waiting.call->listener_);
    }
  }
  for (ReplyListener* const one : listeners) one->all_replied();
}

}  // namespace tfdude
