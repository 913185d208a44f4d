#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "partition/partition.hpp"
#include "support/catch.hpp"
#include "support/memory_store.hpp"
#include "support/replica.hpp"

namespace tfdude::testing {

/// An owner of a partition, which stores its state if it has a store.
struct StoringOwner : Replica {
  static constexpr Time kNow{std::chrono::nanoseconds(1000)};

  explicit StoringOwner(const std::string& name, MemoryStore* kept = nullptr)
      : Replica(name), partition(name, 1, forest, directory), store(kept) {}

  /// @return "ok", or the message of the error
  template <class Body>
  std::string ask(const std::string& id, Body body, Time now = kNow) {
    const Reply reply = partition.answer(Request{0, id, std::move(body)}, now);
    if (store != nullptr) REQUIRE(store->save(unsaved(partition)));
    const auto* error = std::get_if<Error>(&reply.body);
    return error == nullptr ? "ok" : error->message;
  }
  void start(const std::vector<FrameSpec>& configured = {}) {
    REQUIRE(partition.restore(store->load().value(), configured, kNow));
    REQUIRE(store->save(unsaved(partition)));
  }
  bool yield() { return partition.yield(partition.pending_yields(), kNow); }
  std::vector<std::string> conflicts() {
    std::vector<std::string> messages;
    for (const Change& one : directory.changes().take()) {
      if (one.kind == ChangeKind::kConflict) messages.push_back(one.message);
    }
    return messages;
  }

  Partition partition;
  MemoryStore* store;
};

/// The only page of a partition.
[[nodiscard]] inline Page page_with(const std::string& partition, std::vector<PageEntry> entries,
                                    std::vector<Tombstone> tombstones = {}) {
  return {partition, 0, 1, 1, std::move(entries), std::move(tombstones)};
}

}  // namespace tfdude::testing
