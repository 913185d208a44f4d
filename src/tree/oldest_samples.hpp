#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace tfdude {

/// Which histories have the oldest samples: a heap. One writer at a time.
class OldestSamples {
 public:
  /// An edge and its oldest sample, as of a moment. Later that is a later one.
  struct Entry {
    std::int64_t stamp = 0;
    std::uint32_t slot = 0;
    std::uint64_t history = 0;  ///< of the edge: its number

    friend bool operator<(const Entry& a, const Entry& b) { return a.stamp > b.stamp; }
  };

  [[nodiscard]] bool empty() const { return heap_.empty(); }
  void clear() { heap_.clear(); }

  void push(const Entry& entry) {
    heap_.push_back(entry);
    std::push_heap(heap_.begin(), heap_.end());
  }

  /// The one with the oldest sample.
  [[nodiscard]] Entry pop() {
    std::pop_heap(heap_.begin(), heap_.end());
    const Entry oldest = heap_.back();
    heap_.pop_back();
    return oldest;
  }

 private:
  std::vector<Entry> heap_;
};

}  // namespace tfdude
