#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "base/mutex.hpp"
#include "partition/messages.hpp"
#include "transport/fastdds/entities.hpp"

namespace tfdude::fastdds {

/// Values pushed to watchers. Each group of watchers of an owner has its own DDS partition,
/// OWNER/GROUP, so others are sent nothing, and those that watch the same edges share one writer.
/// Thread-safe.
class PushChannels {
 public:
  struct Calls {
    std::function<void(const PushedValues&)> on_pushed;
    std::function<void(std::uint64_t group)> on_watcher;
  };

  /// @param own  the partition that this participant serves; empty: none, so it pushes nothing
  PushChannels(const Context& context, edds::Topic& topic, std::string own, Calls calls)
      : context_(context), topic_(topic), own_(std::move(own)), calls_(std::move(calls)) {}

  [[nodiscard]] Result<void> watch(const std::string& owner, std::uint64_t group);
  void unwatch(std::uint64_t group);
  void push(const PushedValues& pushed);
  void end_pushing(std::uint64_t group);

 private:
  const Context context_;
  edds::Topic& topic_;
  const std::string own_;
  const Calls calls_;
  Mutex mutex_{LockRank::kChannels};
  std::map<std::uint64_t, std::unique_ptr<Reader<wire::State>>> readers_ TFDUDE_GUARDED_BY(mutex_);
  std::map<std::uint64_t, std::shared_ptr<Writer>> writers_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude::fastdds
