#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"

#include "partition/messages.hpp"

namespace tfdude {

/// An owner's rewrites of the past of which not all parts have come. Not thread-safe.
/// @par Memory  Limited: kMost of them, of at most kMaxRewritten samples each, and only what has
///   come. A sender has at most kMostOfOne. If there is no room for one that has none, the rewrite
///   that was heard of least recently, of a sender with several, makes room.
class Rewrites {
 public:
  static constexpr std::size_t kMost = 4;
  static constexpr std::size_t kMostOfOne = 2;
  /// One of which nothing has come for so long is dropped. Its sender repeats a part that is lost
  /// much sooner.
  static constexpr std::chrono::seconds kIdle{10};

  /// Keeps a part. A part that has come before changes nothing.
  /// @return all samples, with the last part: the rewrite is over then. kChangedMeanwhile: it is
  ///   the last one, but others are missing; kTooMuch (too many samples, or rewrites);
  ///   kInvalidInput (the part does not fit the others). All but kTooMuch end the rewrite
  [[nodiscard]] Result<std::optional<std::vector<EdgeSample>>> add(const PeerId& from,
                                                                   const std::string& id,
                                                                   const RewriteRequest& part,
                                                                   Time now);
  void forget(const PeerId& from, std::uint64_t number) { begun_.erase({from, number}); }
  void forget_idle(Time now);

 private:
  struct Begun {
    std::string id;
    TimeInterval interval;
    std::uint32_t total = 0;
    Time heard{};
    std::vector<EdgeSample> samples;                           // the first ones, without a gap
    std::map<std::uint32_t, std::vector<EdgeSample>> further;  // by the place of the first
    std::size_t ahead = 0;                                     // how many these are
  };

  using Key = std::pair<PeerId, std::uint64_t>;  // the sender and its number

  [[nodiscard]] Result<void> make_room(const PeerId& from, const std::string& id);
  [[nodiscard]] static bool fits(const Begun& begun, const std::string& id,
                                 const RewriteRequest& part);
  static void put(Begun& begun, const RewriteRequest& part);

  std::map<Key, Begun> begun_;
};

}  // namespace tfdude
