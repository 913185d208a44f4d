#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"

#include "partition/messages.hpp"

// What an owner keeps of handovers, in memory only. docs/faults.md says what happens if it ends.
namespace tfdude {

/// An estimate of the memory, and of the size in a message, of a sample, or of an edge without its
/// samples.
[[nodiscard]] std::size_t bytes_of(const HandedSample& sample);
[[nodiscard]] std::size_t bytes_of_head(const HandedEdge& edge);

/// The error for a frame that may not be changed meanwhile.
[[nodiscard]] tl::unexpected<Error> being_handed_over(const std::string& id);

/// Frames that this partition hands over to others. Not thread-safe.
class Handovers {
 public:
  using Steady = std::chrono::steady_clock::time_point;

  /// How long frames do not change if nobody asks any more.
  static constexpr std::chrono::seconds kLease{5};
  /// How long a handover may last at most.
  static constexpr std::chrono::seconds kLongest{60};
  /// How long a frame that was handed over stays on the pages, for those who have not heard of its
  /// new owner yet.
  static constexpr std::chrono::seconds kStay{3};

  struct Handover {
    PeerId by{};  ///< the peer that began it; only that goes on with it
    std::string to;
    std::vector<HandedFrame> frames;  ///< as they are offered; the top first
    std::optional<Steady> until{};    ///< absent: someone has just asked
    std::optional<Steady> end{};      ///< at the latest; absent: it has just begun
    /// The new owner has them: they are let go once this epoch is stored.
    std::optional<std::uint64_t> decided{};
  };
  /// A frame that was handed over.
  struct Passed {
    std::string to;
    std::optional<Steady> until{};
  };

  /// A frame that its former owner has not let go yet.
  struct Adopted {
    Owner from = kHeldHere;
    std::uint64_t offered = 0;  ///< the Lamport time of its claim
  };

  std::map<std::string, Handover> all;     ///< by the top
  std::set<std::string> leaving;           ///< frames that it is decided to let go
  std::map<std::string, Passed> passed;    ///< frames that are still on the pages
  std::map<std::string, Adopted> adopted;  ///< by the frame

  [[nodiscard]] bool empty() const { return all.empty() && passed.empty() && adopted.empty(); }
  /// Whether time changes something.
  [[nodiscard]] bool awaits_time() const { return !all.empty() || !passed.empty(); }
  /// Sets when a handover, or the stay of a frame, ends, if that is not set yet. @return whether it
  /// has ended
  [[nodiscard]] static bool is_over(std::optional<Steady>& end, Steady now,
                                    std::chrono::seconds after) {
    if (!end) end = now + after;
    return now >= *end;
  }
};

/// The parts that have come of frames that others hand over to this partition. Not thread-safe.
/// @par Memory  Limited: kMost handovers, each of at most kMaxItems frames and kMostHandedSamples
///   samples, and kMostBytes in all. One of which nothing has come for kIdle is dropped. If a
///   sender that has none finds no room, the one that was heard of least recently, of a sender with
///   several, makes it.
class AdoptedParts {
 public:
  static constexpr std::size_t kMost = 4;
  static constexpr std::chrono::seconds kIdle{10};
  static constexpr std::size_t kMostBytes = 64'000'000;

  /// Keeps a part. @return all edges, with the last part. kTooMuch;
  ///   kChangedMeanwhile: other parts are missing. All errors end it
  [[nodiscard]] Result<std::optional<std::vector<HandedEdge>>> add(const PeerId& from,
                                                                   const std::string& top,
                                                                   const HandedPart& part,
                                                                   Time now);
  void forget_idle(Time now);

 private:
  struct Begun {
    std::uint64_t incarnation = 0;
    std::uint64_t lamport_time = 0;  // of the offer
    std::vector<HandedEdge> edges;
    std::size_t samples = 0;
    std::size_t bytes = 0;
    Time heard{};
  };

  [[nodiscard]] Result<void> make_room(const PeerId& from, const std::string& top);
  [[nodiscard]] Result<void> put(Begun& begun, const std::string& top,
                                 const HandedPart& part) const;

  std::map<std::pair<PeerId, std::string>, Begun> begun_;  // by the sender and the top
};

}  // namespace tfdude
