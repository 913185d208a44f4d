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
    const Number number = ++table_.last_;
    Entry& entry = entries_.emplace_back(
        Entry{partition, static_cast<std::uint32_t>(number), 0, std::nullopt});
    auto& waiting = table_.waiting_;
    waiting.emplace(std::pair<std::string_view, Number>(entry.partition, number),
                    Waiting{this, entries_.size() - 1});
    entry.awaits_from = waiting.lower_bound({entry.partition, 0})->first.second;
  }
}

ReplyTable::Call::~Call() {
  const Lock lock(table_.mutex_);
  for (const Entry& entry : entries_) {
    table_.waiting_.erase({entry.partition, table_.number_of(entry.sequence)});
  }
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
  Entry& given_up = entries_[entry];
  if (given_up.reply) return;
  given_up.reply = Reply{given_up.sequence, 0, std::move(error)};
  table_.waiting_.erase({given_up.partition, table_.number_of(given_up.sequence)});
}

void ReplyTable::on_reply(const std::string& from, const Reply& reply) {
  Signal* arrived = nullptr;
  ReplyListener* listener = nullptr;
  {
    const Lock lock(mutex_);
    const auto waiting = waiting_.find({from, number_of(reply.sequence)});
    if (waiting == waiting_.end()) return;
    Call& call = *waiting->second.call;
    call.entries_[waiting->second.entry].reply = reply;
    waiting_.erase(waiting);
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
    for (auto one = waiting_.lower_bound({partition, 0});
         one != waiting_.end() && one->first.first == partition;) {
      const Waiting waiting = one->second;
      one = waiting_.erase(one);
      auto& entry = waiting.call->entries_[waiting.entry];
      entry.reply = Reply{entry.sequence, 0,
                          Error{Errc::kUnreachable,
                                "partition " + quote(partition) + " left before it replied",
                                {},
                                partition}};
      if (!waiting.call->complete()) continue;
      waiting.call->arrived_->notify_one();
      if (waiting.call->listener_ != nullptr) listeners.push_back(waiting.call->listener_);
    }
  }
  for (ReplyListener* const one : listeners) one->all_replied();
}

}  // namespace tfdude
