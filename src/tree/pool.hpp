#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace tfdude {

/// Objects of one type, reused when no reader can see them any more (epoch.hpp). One writer at a
/// time.
template <class T>
class Pool {
 public:
  [[nodiscard]] T* take() {
    if (free_.empty()) grow();
    T* taken = free_.back();
    free_.pop_back();
    return taken;
  }

  /// Takes an object back that the current commit has superseded, or an earlier one.
  void supersede(T* object) { superseded_.push_back(object); }

  /// Call only between two commits. @param tag  from epoch::retire_tag()
  void collect(std::uint64_t tag, std::uint64_t safe_below) {
    for (T* object : superseded_) waiting_.emplace_back(tag, object);
    superseded_.clear();
    const auto seen = std::find_if(waiting_.begin(), waiting_.end(),
                                   [=](const auto& one) { return one.first >= safe_below; });
    for (auto one = waiting_.begin(); one != seen; ++one) free_.push_back(one->second);
    waiting_.erase(waiting_.begin(), seen);
  }

 private:
  static constexpr std::size_t kBlock = 16;

  void grow() {
    blocks_.push_back(std::make_unique<std::array<T, kBlock>>());
    free_.reserve(blocks_.capacity() * kBlock);
    for (T& object : *blocks_.back()) free_.push_back(&object);
  }

  std::vector<std::unique_ptr<std::array<T, kBlock>>> blocks_;
  std::vector<T*> free_;
  std::vector<T*> superseded_;                         // since the readers were last checked
  std::vector<std::pair<std::uint64_t, T*>> waiting_;  // with their tags, which do not decrease
};

}  // namespace tfdude
