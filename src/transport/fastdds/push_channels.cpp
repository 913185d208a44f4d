#include "transport/fastdds/push_channels.hpp"

#include <utility>

#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/topics.hpp"

namespace tfdude::fastdds {
namespace {

std::string partition_of(const std::string& owner, std::uint64_t group) {
  return owner + "/" + std::to_string(group);
}

}  // namespace

Result<void> PushChannels::watch(const std::string& owner, std::uint64_t group) {
  std::unique_ptr<Reader<wire::State>> reader;  // outlives the lock: see unwatch()
  const Lock lock(mutex_);
  if (readers_.count(group) != 0) return {};
  reader = std::make_unique<Reader<wire::State>>(
      context_, topic_, partition_of(owner, group), "update_reader",
      Reader<wire::State>::Calls{[this](const wire::State& sample, const edds::SampleInfo&) {
                                   if (const auto pushed = from_wire(sample)) {
                                     calls_.on_pushed(*pushed);
                                   } else {
                                     log_refused(kStateTopic, pushed.error());
                                   }
                                 },
                                 nullptr});
  if (!reader->check()) return reader->check();
  readers_.emplace(group, std::move(reader));
  return {};
}

// Closed without the lock: a callback that delivers a DDS sample may be waiting for it.
void PushChannels::unwatch(std::uint64_t group) {
  std::unique_ptr<Reader<wire::State>> closed;  // outlives the lock
  const Lock lock(mutex_);
  const auto known = readers_.find(group);
  if (known == readers_.end()) return;
  closed = std::move(known->second);
  readers_.erase(known);
}

void PushChannels::push(const PushedValues& pushed) {
  std::shared_ptr<Writer> writer;
  {
    const Lock lock(mutex_);
    auto& entry = writers_[pushed.group];
    if (entry == nullptr) {
      entry = std::make_shared<Writer>(context_, topic_, partition_of(own_, pushed.group),
                                       "update_writer",
                                       [this, group = pushed.group] { calls_.on_watcher(group); });
      if (!entry->good()) log_not_created("values are not pushed", entry->check().error());
    }
    writer = entry;
  }
  if (!writer->good()) return;      // until the group ends
  thread_local wire::State sample;  // kept, for its memory
  write_wire(pushed, sample);
  writer->write(&sample);
}

void PushChannels::end_pushing(std::uint64_t group) {
  std::shared_ptr<Writer> ended;  // outlives the lock
  const Lock lock(mutex_);
  const auto known = writers_.find(group);
  if (known == writers_.end()) return;
  ended = std::move(known->second);
  writers_.erase(known);
}

}  // namespace tfdude::fastdds
