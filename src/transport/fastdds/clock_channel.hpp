#pragma once

#include <functional>
#include <memory>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"

#include "base/mutex.hpp"
#include "transport/fastdds/entities.hpp"

namespace tfdude::fastdds {

/// The time of external clocks, in the DDS partition without a name. Best effort: the next value
/// replaces a lost one. Thread-safe.
class ClockChannel {
 public:
  /// @param on_clock  called with each time; null: it is not received
  ClockChannel(const Context& context, edds::Topic& topic, std::function<void(Time)> on_clock);

  /// @return kTransport, with what could not be created
  [[nodiscard]] Result<void> check() const {
    return reader_ != nullptr ? reader_->check() : Result<void>();
  }

  /// Creates the writer at the first use. @return kTransport
  [[nodiscard]] Result<void> publish(Time now);

 private:
  const Context context_;
  edds::Topic& topic_;
  std::unique_ptr<Reader<wire::Clock>> reader_;
  Mutex mutex_{LockRank::kChannels};
  std::shared_ptr<Writer> writer_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude::fastdds
