#pragma once

#include <functional>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "base/mutex.hpp"
#include "transport/fastdds/entities.hpp"

namespace tfdude::fastdds {

/// The writers of one topic, one for each partition or peer.
/// @par Thread safety  All functions are thread-safe. find() may be called in callbacks of Fast
///   DDS, since it does not wait while a writer is created.
template <class Key>
class WriterTable {
 public:
  using Create = std::function<std::shared_ptr<Writer>(const Key&)>;

  explicit WriterTable(Create create) : create_(std::move(create)) {}

  /// @return null if there is none
  [[nodiscard]] std::shared_ptr<Writer> find(const Key& key) const {
    const Lock lock(mutex_);
    const auto known = writers_.find(key);
    return known != writers_.end() ? known->second : nullptr;
  }

  /// Creates the writer at the first use. One that could not be created is not kept.
  std::shared_ptr<Writer> open(const Key& key) {
    if (auto known = find(key)) return known;
    const Lock creating(creating_);
    if (auto known = find(key)) return known;
    auto created = create_(key);
    if (!created->good()) return created;
    const Lock lock(mutex_);
    writers_.emplace(key, created);
    return created;
  }

  /// Removes the writer. @return null if there was none
  [[nodiscard]] std::shared_ptr<Writer> take(const Key& key) {
    const Lock lock(mutex_);
    const auto known = writers_.find(key);
    if (known == writers_.end()) return nullptr;
    auto writer = std::move(known->second);
    writers_.erase(known);
    return writer;
  }

  [[nodiscard]] std::vector<std::pair<Key, std::shared_ptr<Writer>>> all() const {
    const Lock lock(mutex_);
    return {writers_.begin(), writers_.end()};
  }

  /// Deletes the writers. For when no other thread uses the table any more.
  void clear() {
    std::map<Key, std::shared_ptr<Writer>> all;  // deleted without the lock
    {
      const Lock lock(mutex_);
      all.swap(writers_);
    }
  }

 private:
  const Create create_;
  Mutex creating_{LockRank::kChannels};
  mutable Mutex mutex_;
  std::map<Key, std::shared_ptr<Writer>> writers_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude::fastdds
