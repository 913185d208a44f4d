#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>

#include "tfdude/partition/messages.hpp"

#include "transport/fastdds/entities.hpp"

namespace tfdude::fastdds {

/// Values pushed to watchers: each group of them has a DDS partition, so that who does not watch is sent nothing,
/// and who watches the same shares one writer. Thread-safe.
class StateChannels {
 public:
  using Deliver = std::function<void(const State&)>;

  StateChannels(edds::DomainParticipant& participant, edds::Topic& topic, Deliver deliver)
      : participant_(participant), topic_(topic), deliver_(std::move(deliver)) {}

  [[nodiscard]] Result<void> watch(std::uint64_t group);
  void unwatch(std::uint64_t group);
  void push(const State& state);
  void end_pushing(std::uint64_t group);

 private:
  edds::DomainParticipant& participant_;
  edds::Topic& topic_;
  const Deliver deliver_;
  std::mutex mutex_;
  std::map<std::uint64_t, std::unique_ptr<Inlet<wire::State>>> inlets_;
  std::map<std::uint64_t, std::shared_ptr<Outlet>> outlets_;
};

}  // namespace tfdude::fastdds
