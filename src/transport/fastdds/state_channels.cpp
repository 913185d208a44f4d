#include "transport/fastdds/state_channels.hpp"

#include <utility>

#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/topics.hpp"

namespace tfdude::fastdds {
namespace {

std::string partition_of(std::uint64_t group) { return "watch " + std::to_string(group); }

}  // namespace

Result<void> StateChannels::watch(std::uint64_t group) {
  const std::lock_guard lock(mutex_);
  auto& reader = readers_[group];
  if (reader != nullptr) return {};
  reader = std::make_unique<Reader<wire::State>>(
      context_, topic_, partition_of(group), "update_reader",
      Reader<wire::State>::Calls{[this](const wire::State& sample, const ertps::GuidPrefix_t&) {
                                   if (const auto state = from_wire(sample)) {
                                     calls_.on_state(*state);
                                   } else {
                                     log_refused(kStateTopic, state.error());
                                   }
                                 },
                                 nullptr});
  if (reader->good()) return {};
  readers_.erase(group);
  return fail(Errc::kTransport, "Fast DDS could not make a reader of what is watched");
}

// Closed without the lock: a sample may be on its way to somebody who waits for it.
void StateChannels::unwatch(std::uint64_t group) {
  std::unique_ptr<Reader<wire::State>> closed;  // outlives the lock
  const std::lock_guard lock(mutex_);
  const auto known = readers_.find(group);
  if (known == readers_.end()) return;
  closed = std::move(known->second);
  readers_.erase(known);
}

void StateChannels::push(const State& state) {
  std::shared_ptr<Writer> writer;
  {
    const std::lock_guard lock(mutex_);
    auto& entry = writers_[state.group];
    if (entry == nullptr) {
      entry = std::make_shared<Writer>(context_, topic_, partition_of(state.group), "update_writer",
                                       [this, group = state.group] { calls_.on_watcher(group); });
    }
    writer = entry;
  }
  if (!writer->good()) return;
  wire::State sample = to_wire(state);
  writer->write(&sample);
}

void StateChannels::end_pushing(std::uint64_t group) {
  std::shared_ptr<Writer> ended;  // outlives the lock
  const std::lock_guard lock(mutex_);
  const auto known = writers_.find(group);
  if (known == writers_.end()) return;
  ended = std::move(known->second);
  writers_.erase(known);
}

}  // namespace tfdude::fastdds
