#include "tfdude/client/partition_watch.hpp"

#include <utility>

#include "runtime/watched_partition.hpp"

namespace tfdude {

PartitionWatch::PartitionWatch(std::shared_ptr<WatchedPartition> partition)
    : partition_(std::move(partition)) {}

PartitionWatch::PartitionWatch(PartitionWatch&&) noexcept = default;

PartitionWatch& PartitionWatch::operator=(PartitionWatch&& other) noexcept {
  if (this == &other) return *this;
  if (partition_ != nullptr) partition_->end();
  partition_ = std::move(other.partition_);
  return *this;
}

PartitionWatch::~PartitionWatch() {
  if (partition_ != nullptr) partition_->end();
}

}  // namespace tfdude
