#pragma once

#include <functional>
#include <memory>

#include "tfdude/base/export.hpp"
#include "tfdude/types/partition_news.hpp"

namespace tfdude {

class WatchedPartition;

/// How to watch a partition.
struct PartitionWatchOptions {
  /// Maximum rate at which the owner sends changes [Hz]: from once an hour to 1e6; 0: every sample.
  /// With a rate, only the newest sample of each edge is sent. Without one, news may wait 5 ms for
  /// others, so that a stream of 1 kHz wakes few threads.
  double rate = 0;
  /// Gets all news, in order. One call at a time, from a library thread that holds no lock: it may
  /// call any function of the client, and end its own watch. Must not throw. If it takes so long
  /// that 100,000 values wait, further ones are left out, and the owner is asked for them again;
  /// of a stream some samples may then be missing.
  std::function<void(const PartitionNews&)> on_news;
};

/// All edges of a partition, pushed by their owner. They are watched while this object exists, also
/// if the partition goes and comes again. If it is destroyed, a running call is waited for, unless
/// that call itself does it, and no other follows.
class TFDUDE_EXPORT PartitionWatch {
 public:
  explicit PartitionWatch(std::shared_ptr<WatchedPartition> partition);
  PartitionWatch(const PartitionWatch&) = delete;
  PartitionWatch& operator=(const PartitionWatch&) = delete;
  PartitionWatch(PartitionWatch&&) noexcept;
  PartitionWatch& operator=(PartitionWatch&&) noexcept;
  ~PartitionWatch();

 private:
  std::shared_ptr<WatchedPartition> partition_;
};

}  // namespace tfdude
