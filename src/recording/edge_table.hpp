#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <string_view>
#include <unordered_map>

#include "tfdude/types/partition_news.hpp"

namespace tfdude::recording {

/// An edge that messages of a recording name. Each is at one place only, so that it is known again
/// without comparing names.
struct RecordedEdge : WatchedFrame {
  std::uint32_t number = 0;
  std::uint32_t frame = 0;  ///< the number of the first edge of this frame, under any parent
};

/// The edges that messages of a recording have named so far. They stay at their places.
/// @par Memory  About 300 bytes for each.
/// @par Thread safety  One thread at a time. Others may read an edge that they have.
class EdgeTable {
 public:
  EdgeTable() = default;
  EdgeTable(const EdgeTable&) = delete;
  EdgeTable& operator=(const EdgeTable&) = delete;

  /// Null: it was not added yet.
  [[nodiscard]] const RecordedEdge* find(std::string_view id, std::string_view parent) {
    // Messages mostly name the same edges in the same order.
    if (last_ != nullptr && last_->next != nullptr) {
      Entry* next = last_->next;
      if (next->edge.id == id && next->edge.parent == parent) return &(last_ = next)->edge;
    }
    const auto found = entries_by_names_.find({id, parent});
    return found != entries_by_names_.end() ? go_on_to(found->second) : nullptr;
  }

  /// Adds an edge that find() does not find.
  const RecordedEdge* add(std::string_view id, std::string_view parent) {
    const auto number = static_cast<std::uint32_t>(entries_.size());
    Entry& entry = entries_.emplace_back();
    entry.edge.id = id;
    entry.edge.parent = parent;
    entry.edge.number = number;
    entry.edge.frame = frames_.try_emplace(entry.edge.id, number).first->second;
    entries_by_names_.emplace(Names{entry.edge.id, entry.edge.parent}, &entry);
    return go_on_to(&entry);
  }

 private:
  struct Entry {
    RecordedEdge edge;
    Entry* next = nullptr;  // what was named after it the last time
  };
  struct Names {
    std::string_view id;
    std::string_view parent;

    friend bool operator==(const Names& a, const Names& b) {
      return a.id == b.id && a.parent == b.parent;
    }
  };
  struct Hash {
    std::size_t operator()(const Names& names) const {
      const std::hash<std::string_view> hash;
      return hash(names.id) * 31 + hash(names.parent);
    }
  };

  const RecordedEdge* go_on_to(Entry* entry) {
    if (last_ != nullptr) last_->next = entry;
    last_ = entry;
    return &entry->edge;
  }

  std::deque<Entry> entries_;
  std::unordered_map<Names, Entry*, Hash> entries_by_names_;
  std::unordered_map<std::string_view, std::uint32_t> frames_;
  Entry* last_ = nullptr;
};

}  // namespace tfdude::recording
